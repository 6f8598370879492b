#pragma once
#include <vector>

#include "covol/bricks.h"

namespace covol::bricks {

/// Splits the domain along leaves, at the median of the band along an axis, until no part has more voxels of the band
/// than `options` allow, or a part cannot be split. The bricks cover the whole domain.
[[nodiscard]] std::vector<Brick> split(const Domain& domain, const FloatGrid& coarse, const BrickOptions& options);

/// The core with `layers` more voxels on every side, limited by the domain.
[[nodiscard]] Domain around(const Domain& domain, const VoxelBox& core, int layers);

}  // namespace covol::bricks
