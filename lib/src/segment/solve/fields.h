#pragma once
// The fields that drive the flow: the distance to the points, and the image's edges.
#include "segment/start/start_surface.h"

namespace covol::pipeline {

inline constexpr double kTubeSlackVoxels = 2.0;  // the upwind scheme reads one voxel beyond the band

/// Width of the band and of the neighbours that the scheme reads, world units.
[[nodiscard]] inline double band_slack(double h) { return (kHalfWidthVoxels + kTubeSlackVoxels) * h; }

/// The distance to the points within `radius`, world units; its time is added to `report`.
/// @param reach  the part of the radius that does not depend on h; the memory estimate keeps it for a larger h
/// @throws Error InvalidOptions if the memory would not suffice.
[[nodiscard]] FloatGridPtr find_distance(const std::vector<Vec3>& points, const Domain& domain, double radius,
                                         double reach, StepReport& report, const RunContext& run);

/// The same as far as the flow from `start` needs it, null if no points attract. Beyond the attraction range d is not
/// needed. Without a range it must reach from the start to the points: the surface moves down the gradient of d, so
/// that the maximum of d on the start bounds all values that it meets.
[[nodiscard]] FloatGridPtr find_distance_for_flow(const StartFacts& start, const FloatGrid& u, StepReport& report,
                                                  const RunContext& run);

/// The distance to the trusted marks, if they outweigh the points between the slices of contours and the image acts;
/// otherwise null.
[[nodiscard]] FloatGridPtr find_trusted_distance(const Problem& problem, const StartFacts& start, StepReport& report);

/// How g is computed: the options as used, which fix its meaning.
struct EdgeChoice {
    EdgeOptions options;
    StepReport report;
};

/// Chooses the edge feature from the image at the marks of contours.
[[nodiscard]] EdgeChoice choose_edge_feature(const Problem& problem, const Choices& choices);

/// g on the band of a flow.
struct Edges {
    FloatGridPtr grid;    ///< null if the image does not act
    EdgeOptions options;  ///< later calls use the same K and range
    EdgeReport found;
    StepReport report;
};

/// g on the band of `u`, with a margin for its movement if it follows the surface.
[[nodiscard]] Edges find_edges(const Problem& problem, const StartFacts& start, const FloatGrid& u,
                               const EdgeOptions& options);

/// g on the band of `u` if it has moved beyond the one of `edges`, else null.
[[nodiscard]] FloatGridPtr extended_edges(const Problem& problem, const StartFacts& start, const FloatGrid& u,
                                          const Edges& edges);

}  // namespace covol::pipeline
