#pragma once
// Parts of a scan that do not quite fit on each other lie there as two layers.
#include <vector>

#include "cloud/poisson/winding_field.h"
#include "covol/orientation.h"

namespace covol::cloud {

/// Turns the normals of layers that face inwards because the layer above them hides them: all that they see is the
/// inside of the scan, through a gap in it. Each patch of points whose free directions oppose those of the points
/// beside and above it is turned to try, the largest first, and stays turned where its points remain close to the
/// surface and a cavity goes: less of the surface is without points then, by up to about as much as the patch has. The
/// inner wall of a cup stays, for without it more is bare; so does that of a ring, whose hole would close.
/// @param field    in/out: the indicator of `orientation`, scaled to 1/2
/// @param free     free_directions()
/// @param between  distance from which on points are not of one sheet, world units
/// @return for each point whether it was turned
[[nodiscard]] std::vector<char> turn_layers(WindingField& field, const std::vector<Vec3>& points,
                                            const std::vector<Vec3>& free, double between, Orientation& orientation,
                                            const RunContext& run);

}  // namespace covol::cloud
