#pragma once
#include <vector>

#include "covol/bricks.h"

namespace covol::bricks {

/// Splits the domain along leaves until no part has more of the surface's band than `options` allow; parts are about
/// equal. Bricks that no band touches are left out: their leaves belong to nobody, and nothing is in them.
[[nodiscard]] std::vector<Brick> split(const Domain& domain, const FloatGrid& coarse, const BrickOptions& options);

/// The core with `layers` voxels more on every side, as far as the domain goes.
[[nodiscard]] Domain around(const Domain& domain, const VoxelBox& core, int layers);

}  // namespace covol::bricks
