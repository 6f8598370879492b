#pragma once
#include <vector>

#include "covol/bricks.h"

namespace covol::bricks {

/// Splits the domain along leaves until no part has more of the surface's band than `options` allow; parts are about
/// equal. Bricks without any part of the band are omitted: their leaves belong to no brick and stay empty.
[[nodiscard]] std::vector<Brick> split(const Domain& domain, const FloatGrid& coarse, const BrickOptions& options);

/// The core with `layers` more voxels on every side, limited by the domain.
[[nodiscard]] Domain around(const Domain& domain, const VoxelBox& core, int layers);

}  // namespace covol::bricks
