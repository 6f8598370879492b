#pragma once
#include "covol/domain.h"
#include "covol/fwd.h"
#include "covol/run.h"

namespace covol::detail {

/// How far the band of a moving surface reaches, in voxels: the 3 of the clamp and about two that the surface may move
/// before the band is made again. (Each time shifts the surface by about 0.1 h² times its curvature: rarely is better.)
inline constexpr double kFollowWidth = 5.0;

/// Re-makes u as the signed distance to its zero level set, clamped to `clamp` voxels (at most kFollowWidth), in a band
/// of kFollowWidth voxels inside the domain.
///
/// Under curvature alone a profile flattens at its clamp and that drags the surface (a sphere then lost first order),
/// so it wants the whole width. Under advection it grows into a step as high as the clamp, and a higher step creeps
/// faster off an image edge.
/// @throws Error InvalidInput when u has no zero level set.
void follow_surface(FloatGrid& u, const Domain& domain, double clamp, const RunContext& run);

}  // namespace covol::detail
