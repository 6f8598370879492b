#pragma once
#include <span>
#include <vector>

#include "covol/fwd.h"

namespace covol::detail {

/// Values of a level set at places of the world, trilinear between voxels.
[[nodiscard]] std::vector<double> levels_at(const FloatGrid& u, std::span<const Vec3> places);

}  // namespace covol::detail
