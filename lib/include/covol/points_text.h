#pragma once
#include <string>

#include "covol/points.h"

namespace covol {

/// read_points() of a text in columns, as .xyz and .csv files have it, that is no file.
/// @param source  what messages call it
/// @throws Error InvalidInput, InvalidOptions as read_points().
[[nodiscard]] COVOL_API PointCloud parse_points(const std::string& text, const std::string& source,
                                                const ReadPointsOptions& options = {});

}  // namespace covol
