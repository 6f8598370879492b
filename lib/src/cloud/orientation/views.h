#pragma once
// Normals of a scan that encloses nothing: what was measured was seen, from outside.
#include "cloud/poisson/winding_field.h"
#include "covol/orientation.h"

namespace covol::cloud {

/// For each point the mean of the directions in which the view from its cell is free, no other cell with points being
/// in the way (the ray votes of Mullen and others, Signing the unsigned, SGP 2010); zero where it sees nothing.
/// @param cell  edge of the cells, as wide as a sheet of points needs to have no holes
[[nodiscard]] std::vector<Vec3> free_directions(const std::vector<Vec3>& points, double cell);

/// Where scans of one side were seen from: the direction in which more points are free than in the opposite one, if
/// there is any, as of the ground with roofs and trees above it; with a small weight the directions in which each is
/// free, for what stands upright.
[[nodiscard]] std::vector<Vec3> towards_sky(const std::vector<Vec3>& points, const CloudScale& scale);

/// Share of the points from which nothing is in the way in a direction of their own; those without one, 0, do not
/// count.
[[nodiscard]] double fraction_free(const std::vector<Vec3>& points, const std::vector<Vec3>& directions,
                                   const CloudScale& scale);

/// Adds the indicator that is drawn to 1/2 at the points as well (Kazhdan and Hoppe, Screened Poisson surface
/// reconstruction, ACM Trans. Graph. 32(3), 2013): sheets that enclose nothing lie at 1/2 by that alone. Normals take
/// its directions, each on its own side.
/// @param is_free  of each point, whether the surface need not pass it; empty: of none
/// @param start    null: solved for from nothing
void add_screened(const std::vector<Vec3>& points, const CloudScale& scale, const std::vector<char>& is_free,
                  const StackField* start, Orientation& result, const RunContext& run);

/// Normals towards where each point can be seen from, and their indicator, solved for once; add_screened() brings that
/// closer to the points, with more handles where layers of the scan differ.
[[nodiscard]] Orientation orient_by_views(const std::vector<Vec3>& points, const CloudScale& scale,
                                          const RunContext& run);

}  // namespace covol::cloud
