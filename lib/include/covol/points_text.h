#pragma once
#include <string>

#include "covol/points.h"

namespace covol {

/// read_points() for a text in columns, as in .xyz and .csv files, that is not in a file.
/// @param source  its name in messages
/// @throws Error InvalidInput, InvalidOptions as read_points().
[[nodiscard]] COVOL_API PointCloud parse_points(const std::string& text, const std::string& source,
                                                const ReadPointsOptions& options = {});

}  // namespace covol
