#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/points.h"

namespace covol {

/// Positions that a program has in memory, understood as read_points() understands those of a file.
/// @param positions  as `reading` says; where it states no space they are world units, and check_inside() may doubt
/// that
/// @param source     what messages call them
[[nodiscard]] COVOL_API PointCloud make_cloud(const std::vector<Vec3>& positions, const ReadPointsOptions& reading = {},
                                              const std::string& source = "points");

}  // namespace covol
