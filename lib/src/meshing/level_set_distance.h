#pragma once
#include <vector>

#include "covol/fwd.h"

namespace covol::detail {

/// The distance of each point to a level set, world units: the interpolated value up to a voxel from the band's end,
/// and beyond that the distance to the nearest crossing of the surface with an edge of the lattice, at most 0.12 voxels
/// too large. In parallel; the former needs no additional memory, the latter 25 bytes for each crossing.
/// @pre a signed distance that changes sign
[[nodiscard]] std::vector<double> distances_to(const FloatGrid& surface, const std::vector<Vec3>& points);

}  // namespace covol::detail
