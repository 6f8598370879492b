#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/points.h"

namespace covol {

/// Makes a cloud from positions in memory, interpreted as read_points() interprets positions in a file.
/// @param positions  in the coordinates given by `reading`; if `reading` states no space, they are taken as world
/// units, and check_inside() may warn that this is implausible
/// @param source     name of the points in messages
[[nodiscard]] COVOL_API PointCloud make_cloud(const std::vector<Vec3>& positions, const ReadPointsOptions& reading = {},
                                              const std::string& source = "points");

}  // namespace covol
