#pragma once
#include <span>
#include <vector>

#include "covol/fwd.h"

namespace covol::detail {

/// Value of a level set at a world position, trilinear between voxels.
[[nodiscard]] double level_at(const FloatGrid& u, const Vec3& place);

/// Values of a level set at world positions, trilinear between voxels.
[[nodiscard]] std::vector<double> levels_at(const FloatGrid& u, std::span<const Vec3> places);

}  // namespace covol::detail
