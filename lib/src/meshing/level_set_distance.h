#pragma once
#include <vector>

#include "covol/fwd.h"

namespace covol::detail {

/// The distance of each point to a level set, world units: within its half width the interpolated value, beyond it that
/// to the nearest cut edge of the lattice, at most 0.12 voxels too large. In parallel; nothing is held for the first,
/// 25 bytes for each cut edge where a point lies beyond.
/// @pre a signed distance that changes sign
[[nodiscard]] std::vector<double> distances_to(const FloatGrid& surface, const std::vector<Vec3>& points);

}  // namespace covol::detail
