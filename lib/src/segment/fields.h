#pragma once
// What the flow is driven by: the distance to the points, and the image's edges.
#include "segment/job.h"

namespace covol::pipeline {

inline constexpr double kTubeSlackVoxels = 2.0;  // the upwind scheme looks one voxel beyond the band

/// The band and what the scheme looks at beside it, world units.
[[nodiscard]] inline double band_slack(const Job& job) { return (kHalfWidthVoxels + kTubeSlackVoxels) * job.h(); }

/// @param reach  the part of the radius that does not depend on h; in memory's estimate a larger h keeps it
/// @pre the domain is chosen. @throws Error InvalidOptions where memory would not do.
void find_distance(Job& job, double radius, double reach = 0);

/// The radius for find_distance() that the flow from job.result.u needs. Beyond the attraction range d is not
/// needed. Without one it must reach from the start to the points: the surface moves down d, so the largest d on the
/// start bounds what it meets.
[[nodiscard]] double tube_for_start(Job& job);

/// Where the image acts, marks outweigh what lies between the slices of contours.
void compute_trusted_distance(Job& job);

/// The marks of contours tell what the border looks like in this image.
void choose_edge_feature(Job& job);

/// g on the band, with room to move where it follows the surface. Fixes what g means: later calls take the same K.
void find_edges(Job& job);

/// g on the band of `u` where that has moved beyond the one in `fields`.
void extend_edges(Job& job, const FloatGrid& u, EvolveFields& fields);

}  // namespace covol::pipeline
