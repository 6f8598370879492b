#pragma once
#include <vector>

#include "covol/fwd.h"

namespace covol::detail {

/// The distance of each point to a level set, world units: the interpolated value for points more than a voxel inside
/// the band's end, and for all others the distance to the nearest crossing of the surface with an edge of the lattice,
/// which is at most 0.12 voxels too large. Computed in parallel; crossings need 25 bytes of memory each.
/// @pre `surface` is a signed distance with values of both signs
[[nodiscard]] std::vector<double> distances_to(const FloatGrid& surface, const std::vector<Vec3>& points);

}  // namespace covol::detail
