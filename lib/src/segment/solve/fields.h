#pragma once
// The fields that drive the flow: the distance to the points, and the image's edges.
#include "segment/start/start_surface.h"

namespace covol::pipeline {

inline constexpr double kTubeSlackVoxels = 2.0;  // the upwind scheme reads one voxel beyond the band

/// Half-width of the band, plus the voxels beyond it that the scheme reads, world units.
[[nodiscard]] inline double band_slack(double h) { return (kHalfWidthVoxels + kTubeSlackVoxels) * h; }

/// The distance to the points within `radius`, world units; its time is added to `report`.
/// @param reach  the part of the radius that does not depend on h; the memory estimate keeps it for a larger h
/// @throws Error InvalidOptions if the memory would not suffice.
[[nodiscard]] FloatGridPtr find_distance(const std::vector<Vec3>& points, const Domain& domain, double radius,
                                         double reach, StepReport& report, const RunContext& run);

/// The distance to the points as far as the flow from `start` needs it; null if no points attract. That is up to the
/// attraction range; without one, up to the maximum of d on the start: the surface moves down the gradient of d, so
/// that it meets no larger values.
[[nodiscard]] FloatGridPtr find_distance_for_flow(const StartFacts& start, const FloatGrid& u, StepReport& report,
                                                  const RunContext& run);

/// The distance to the trusted marks, by which these outweigh the points between the slices of contours. Null unless
/// there are contours, both points and image are used, and the attraction range is limited.
[[nodiscard]] FloatGridPtr find_trusted_distance(const Problem& problem, const StartFacts& start, StepReport& report);

/// The options of the edge detector g, with the feature that was chosen.
struct EdgeChoice {
    EdgeOptions options;
    StepReport report;
};

/// Chooses the edge feature from the image at the marks of contours.
[[nodiscard]] EdgeChoice choose_edge_feature(const Problem& problem, const Choices& choices);

/// g on the band of a flow.
struct Edges {
    FloatGridPtr grid;    ///< null if the image is not used
    EdgeOptions options;  ///< with the feature, K and intensity range as used, which later calls use, too
    EdgeReport found;
    StepReport report;
};

/// g on the band of `u`, with a margin for its movement if it follows the surface.
[[nodiscard]] Edges find_edges(const Problem& problem, const StartFacts& start, const FloatGrid& u,
                               const EdgeOptions& options);

/// g on the band of `u` if that band has left the region of `edges`, else null.
[[nodiscard]] FloatGridPtr extended_edges(const Problem& problem, const StartFacts& start, const FloatGrid& u,
                                          const Edges& edges);

}  // namespace covol::pipeline
