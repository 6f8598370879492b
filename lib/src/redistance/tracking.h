#pragma once
#include <vector>

#include "covol/domain.h"
#include "covol/fwd.h"
#include "covol/run.h"
#include "grid/leaf_band.h"
#include "redistance/local_distance.h"

namespace covol::detail {

/// Between these a level set is near enough to a distance, |grad u| without units: it need not be made again.
inline constexpr double kFlattest = 0.5, kSteepest = 2.0;

/// Re-makes u as the signed distance to its zero level set, clamped to `clamp` voxels (at most kTrackingWidth), in a
/// band of kTrackingWidth voxels inside the domain, to first order by Godunov's scheme: as it is made again every few
/// steps, too.
///
/// Under curvature alone a profile flattens at its clamp and that drags the surface (a sphere then lost first order),
/// so it wants the whole width. Under advection it grows into a step as high as the clamp, and a higher step creeps
/// faster off an image edge.
/// @throws Error InvalidInput when u has no zero level set.
void track_surface(FloatGrid& u, const Domain& domain, double clamp);

/// The same for the leaves `stale` only, where the front has moved too far within the band: the band and the values of
/// these leaves and of the 26 around each are made again; all other values keep their bits.
/// @return the leaves that may have changed, sorted; some may be gone from u
std::vector<Coord> track_surface_near(const std::vector<Coord>& stale, FloatGrid& u, const Domain& domain,
                                      double clamp);

/// The half width of the band of a surface that nothing holds, voxels. What the band's end, which stands still, does to
/// the motion of the front falls by a factor of e each sqrt(delta tau): with tau = h^2 / delta to a thousandth.
inline constexpr double kFreeWidth = 7.0;

/// Re-makes u as the signed distance to its zero level set for a surface that nothing will hold, so that its way is the
/// result. Where |grad u| is between kFlattest and kSteepest, voxels next to the front get u / |grad u|, which is right
/// to second order and leaves the front where it is: a ball of 16 voxels moves by less than 0.002. The others get the
/// exact distance to the front's polygons, which lie within a convex front.
/// @throws Error InvalidInput when u has no zero level set.
void track_free_surface(FloatGrid& u, const Domain& domain, const RunContext& run);

}  // namespace covol::detail
