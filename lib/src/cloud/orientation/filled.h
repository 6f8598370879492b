#pragma once
// Points that fill a solid and do not lie on a surface.
#include <vector>

#include "covol/orientation.h"

namespace covol::cloud {

/// Whether neighbourhoods are typically not sheets at any size, from about eight points to an eighth of all points. In
/// a sheet that is wider than its noise, the standard deviation of the points along the normal is a small fraction of
/// the radius; for points that fill a ball it is 0.45 radii at any size.
/// @param spacing  approximate distance between the points, world units
[[nodiscard]] bool fill_a_solid(const std::vector<Vec3>& points, double spacing, const RunContext& run);

/// Orientation of points that fill a solid: the indicator is their density divided by its median over the points, so
/// that its level 1/2 is the border of a solid that they fill evenly; normals point to lower density.
/// @param scale  scale of the points, whose near_reach determines the spacing
[[nodiscard]] Orientation orient_filled(const std::vector<Vec3>& points, const CloudScale& scale);

}  // namespace covol::cloud
