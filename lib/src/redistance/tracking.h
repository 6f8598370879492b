#pragma once
#include <vector>

#include "covol/domain.h"
#include "covol/fwd.h"
#include "covol/run.h"
#include "grid/leaf_band.h"
#include "redistance/local_distance.h"

namespace covol::detail {

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

/// As track_surface(), by exact distances, which take some twenty times as long: for a surface that nothing will hold,
/// so that its way is the result.
void track_surface_exactly(FloatGrid& u, const Domain& domain, double clamp, const RunContext& run);

}  // namespace covol::detail
