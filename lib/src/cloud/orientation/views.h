#pragma once
// Normals of a scan that encloses nothing, from the directions in which each point is visible from outside.
#include "cloud/poisson/winding_field.h"
#include "covol/orientation.h"

namespace covol::cloud {

/// For each point, the mean of its free directions, those in which the view from its cell is not blocked by another
/// cell with points (the ray votes of Mullen et al., Signing the unsigned, SGP 2010); 0 if no direction is free.
/// @param cell  edge length of the cells, wide enough for a sheet of points to have no holes
[[nodiscard]] std::vector<Vec3> free_directions(const std::vector<Vec3>& points, double cell);

/// For each point of a scan of one side, the direction from which it was seen: the common direction in which more
/// points have a free view than in the opposite one, as for ground with roofs and trees above it. The mean free
/// direction of the point itself is added with a small weight, for vertical surfaces; without a common direction, it
/// alone is returned.
[[nodiscard]] std::vector<Vec3> towards_sky(const std::vector<Vec3>& points, const CloudScale& scale);

/// Fraction of the points with a free view in the given direction of each; points with direction 0 do not count.
[[nodiscard]] double fraction_free(const std::vector<Vec3>& points, const std::vector<Vec3>& directions,
                                   const CloudScale& scale);

/// Sets result.screened, an indicator that is also fitted to 1/2 at the points (Kazhdan and Hoppe, Screened Poisson
/// surface reconstruction, ACM Trans. Graph. 32(3), 2013), so that even sheets that enclose nothing lie at 1/2. Normals
/// on the same side as those of result.indicator are replaced by them; points with other normals are excluded from that
/// fit, and result.turned is their fraction.
/// @param is_free  for each point, whether it is excluded from that fit as well; empty: no further points are
/// @param start    initial value; null: none
void add_screened(const std::vector<Vec3>& points, const CloudScale& scale, const std::vector<char>& is_free,
                  const StackField* start, Orientation& result, const RunContext& run);

/// Normals towards the side from which each point can be seen, and their indicator after a single solution; the
/// indicator of add_screened() is closer to the points, but has more handles where layers of the scan differ.
[[nodiscard]] Orientation orient_by_views(const std::vector<Vec3>& points, const CloudScale& scale,
                                          const RunContext& run);

}  // namespace covol::cloud
