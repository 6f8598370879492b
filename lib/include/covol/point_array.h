#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/points.h"

namespace covol {

/// Positions that a program has in memory, interpreted as read_points() interprets those of a file.
/// @param positions  in the coordinates given by `reading`; if it states no space they are world units, and
///     check_inside() may question that
/// @param source     what messages call them
[[nodiscard]] COVOL_API PointCloud make_cloud(const std::vector<Vec3>& positions, const ReadPointsOptions& reading = {},
                                              const std::string& source = "points");

}  // namespace covol
