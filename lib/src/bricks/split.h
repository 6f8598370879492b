#pragma once
#include <vector>

#include "covol/bricks.h"

namespace covol::bricks {

/// Splits the domain into bricks that cover it. Parts are split recursively between leaves, at the median of the voxels
/// of the band along an axis, until each has at most as many voxels of the band as `options` allow, or cannot be split.
[[nodiscard]] std::vector<Brick> split(const Domain& domain, const FloatGrid& coarse, const BrickOptions& options);

/// The core with `layers` more voxels on every side, limited by the domain.
[[nodiscard]] Domain around(const Domain& domain, const VoxelBox& core, int layers);

}  // namespace covol::bricks
