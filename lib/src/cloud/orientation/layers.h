#pragma once
// Layers that arise if parts of a scan do not fit each other exactly.
#include <vector>

#include "cloud/poisson/winding_field.h"
#include "covol/orientation.h"

namespace covol::cloud {

/// Reverses the normals of layers that face inwards because the layer above hides them: their only free directions lead
/// through the inside of the scan and a gap in it. Each patch of points whose free directions oppose those of the
/// points around it is reversed tentatively, the largest first. It remains reversed if its points are still close to
/// the surface and the area without points decreases by at most about the area of the patch, as it does if a cavity
/// vanishes. The inner wall of a cup is not reversed, because the area without points would increase, nor is that of a
/// ring, whose hole would close.
/// @param field    in/out: the indicator of `orientation`, scaled to 1/2
/// @param free     free_directions()
/// @param between  distance from which on points are not of one sheet, world units
/// @return for each point, whether its normal was reversed
[[nodiscard]] std::vector<char> turn_layers(WindingField& field, const std::vector<Vec3>& points,
                                            const std::vector<Vec3>& free, double between, Orientation& orientation,
                                            const RunContext& run);

}  // namespace covol::cloud
