#pragma once
#include <string>

#include "covol/points.h"

namespace covol {

/// Reads points as read_points() does, from a text in columns, as in .xyz and .csv files, instead of a file.
/// @param source  name of the text in messages
/// @throws Error InvalidInput, InvalidOptions as read_points().
[[nodiscard]] COVOL_API PointCloud parse_points(const std::string& text, const std::string& source,
                                                const ReadPointsOptions& options = {});

}  // namespace covol
