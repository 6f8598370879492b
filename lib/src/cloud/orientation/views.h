#pragma once
// Normals of a scan that encloses nothing: each point was visible from outside when it was measured.
#include "cloud/poisson/winding_field.h"
#include "covol/orientation.h"

namespace covol::cloud {

/// For each point, the mean of the directions in which the view from its cell is not blocked by another cell with
/// points (the ray votes of Mullen et al., Signing the unsigned, SGP 2010); 0 if no direction is free.
/// @param cell  edge of the cells, wide enough for a sheet of points to have no holes
[[nodiscard]] std::vector<Vec3> free_directions(const std::vector<Vec3>& points, double cell);

/// The direction from which scans of one side were seen, for each point: the direction in which more points have a free
/// view than in the opposite one, if there is such a direction, for instance for ground with roofs and trees above it;
/// with a small weight, the free directions of the point itself, for vertical surfaces.
[[nodiscard]] std::vector<Vec3> towards_sky(const std::vector<Vec3>& points, const CloudScale& scale);

/// Fraction of the points with a free view in the given direction of each; points with direction 0 do not count.
[[nodiscard]] double fraction_free(const std::vector<Vec3>& points, const std::vector<Vec3>& directions,
                                   const CloudScale& scale);

/// Adds an indicator that is also attracted to 1/2 at the points (Kazhdan and Hoppe, Screened Poisson surface
/// reconstruction, ACM Trans. Graph. 32(3), 2013), so that even sheets that enclose nothing lie at 1/2. Normals take
/// its directions without changing sides.
/// @param is_free  for each point, whether the surface need not pass through it; empty: it must for all
/// @param start    initial value; null: none
void add_screened(const std::vector<Vec3>& points, const CloudScale& scale, const std::vector<char>& is_free,
                  const StackField* start, Orientation& result, const RunContext& run);

/// Normals towards the side from which each point can be seen, and their indicator after a single solution;
/// add_screened() brings it closer to the points, but with more handles where layers of the scan differ.
[[nodiscard]] Orientation orient_by_views(const std::vector<Vec3>& points, const CloudScale& scale,
                                          const RunContext& run);

}  // namespace covol::cloud
