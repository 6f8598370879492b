#pragma once
#include "covol/domain.h"

namespace covol::detail {

/// Gives the tiles of a level set the sign that the leaves beside them have, and plus or minus the background.
/// OpenVDB's own flood (tools::signedFloodFill) takes the begin of each row for outside, which is wrong where the level
/// set is cut off there, as at the end of a domain.
/// Only leaves and tiles that meet the domain count: beyond its end, where there are no leaves, inside and outside are
/// not apart.
/// @pre every voxel of the leaves has its sign, active or not; no surface passes between a leaf and a tile
void flood_tiles(FloatGrid& level_set, const Domain& domain);

}  // namespace covol::detail
