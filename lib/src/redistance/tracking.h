#pragma once
#include <vector>

#include "covol/domain.h"
#include "covol/fwd.h"
#include "covol/run.h"
#include "grid/leaf_band.h"
#include "redistance/local_distance.h"

namespace covol::detail {

/// If |grad u| (dimensionless) is between these bounds, u is close enough to a distance and is not redistanced.
inline constexpr double kFlattest = 0.5, kSteepest = 2.0;

/// Redistances u: the signed distance to its zero level set, clamped to `clamp` voxels (at most kTrackingWidth), in a
/// band of kTrackingWidth voxels inside the domain, to first order by Godunov's scheme (LocalDistance).
///
/// If only curvature moves the surface, the clamp should be kTrackingWidth: u flattens near a smaller clamp, which
/// disturbs the motion (for a sphere, first-order convergence was lost). Under advection the clamp should be smaller:
/// u becomes a step as high as the clamp, and a higher step moves off an image edge faster.
/// @throws Error InvalidInput if u has no zero level set.
void track_surface(FloatGrid& u, const Domain& domain, double clamp);

/// The same only around the leaves `stale`, in which the front has moved too far within the band: the band and the
/// values of these leaves and of the 26 around each are recomputed. All other values remain bitwise equal.
/// @return the leaves that may have changed, sorted; some may have been removed from u
std::vector<Coord> track_surface_near(const std::vector<Coord>& stale, FloatGrid& u, const Domain& domain,
                                      double clamp);

/// The half width, in voxels, of the band of a surface that neither points nor edges hold. The influence of the band's
/// end, which does not move, on the front decreases by a factor of e for each length sqrt(delta tau), where delta is
/// the weight of curvature and tau the time step. For tau = h^2 / delta this length is a voxel, and the influence is a
/// thousandth at this width.
inline constexpr double kFreeWidth = 7.0;

/// Redistances u for a surface that neither points nor edges will hold, so that its path is the result, not a steady
/// state. Voxels next to the front at which |grad u| is between kFlattest and kSteepest get u / |grad u|, which is
/// accurate to second order and does not move the front: that of a ball with a radius of 16 voxels moves by less than
/// 0.002 voxels. All others get the exact distance to the front's polygons, which lie slightly inside a convex front.
/// @throws Error InvalidInput if u has no zero level set.
void track_free_surface(FloatGrid& u, const Domain& domain, const RunContext& run);

}  // namespace covol::detail
