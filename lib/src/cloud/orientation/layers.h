#pragma once
// Layers that result from parts of a scan that do not quite fit each other.
#include <vector>

#include "cloud/poisson/winding_field.h"
#include "covol/orientation.h"

namespace covol::cloud {

/// Turns the normals of layers that face inwards because the layer above hides them: their only free view is of the
/// inside of the scan, through a gap in it. Each patch of points whose free directions oppose those of the points
/// beside and above it is turned on trial, the largest first, and stays turned if its points remain close to the
/// surface and a cavity vanishes: the area without points then decreases, by at most about the area of the patch. The
/// inner wall of a cup is not turned, because the area without points would increase, nor is that of a ring, whose hole
/// would close.
/// @param field    in/out: the indicator of `orientation`, scaled to 1/2
/// @param free     free_directions()
/// @param between  distance from which on points are not of one sheet, world units
/// @return for each point whether it was turned
[[nodiscard]] std::vector<char> turn_layers(WindingField& field, const std::vector<Vec3>& points,
                                            const std::vector<Vec3>& free, double between, Orientation& orientation,
                                            const RunContext& run);

}  // namespace covol::cloud
