#pragma once
#include "covol/domain.h"

namespace covol::detail {

/// Gives the tiles of a level set the sign of the leaves beside them, and plus or minus the background as value.
/// OpenVDB's own flood fill (tools::signedFloodFill) assumes that each row begins outside, which is wrong if the level
/// set is cut off there, as at the end of a domain. Only leaves and tiles that meet the domain are used: beyond its
/// end, where there are no leaves, nothing separates inside and outside.
/// @pre every voxel of the leaves has its sign, active or not; no surface passes between a leaf and a tile
void flood_tiles(FloatGrid& level_set, const Domain& domain);

}  // namespace covol::detail
