#pragma once
// What the flow is driven by: the distance to the points, and the image's edges.
#include "segment/start/start_surface.h"

namespace covol::pipeline {

inline constexpr double kTubeSlackVoxels = 2.0;  // the upwind scheme looks one voxel beyond the band

/// The band and what the scheme looks at beside it, world units.
[[nodiscard]] inline double band_slack(double h) { return (kHalfWidthVoxels + kTubeSlackVoxels) * h; }

/// The distance to the points within `radius`, world units; its time is added to `report`.
/// @param reach  the part of the radius that does not depend on h; in memory's estimate a larger h keeps it
/// @throws Error InvalidOptions where memory would not do.
[[nodiscard]] FloatGridPtr find_distance(const std::vector<Vec3>& points, const Domain& domain, double radius,
                                         double reach, StepReport& report, const RunContext& run);

/// The same as far as the flow from `start` needs it, null where no points pull. Beyond the attraction range d is not
/// needed. Without one it must reach from the start to the points: the surface moves down d, so the largest d on the
/// start bounds what it meets.
[[nodiscard]] FloatGridPtr find_distance_for_flow(const StartFacts& start, const FloatGrid& u, StepReport& report,
                                                  const RunContext& run);

/// To the trusted marks, where they outweigh what lies between the slices of contours, and the image acts; else null.
[[nodiscard]] FloatGridPtr find_trusted_distance(const Problem& problem, const StartFacts& start, StepReport& report);

/// How g is found: the options that were used, which fix what it means.
struct EdgeChoice {
    EdgeOptions options;
    StepReport report;
};

/// The marks of contours tell what the border looks like in this image.
[[nodiscard]] EdgeChoice choose_edge_feature(const Problem& problem, const Choices& choices);

/// g on the band of a flow.
struct Edges {
    FloatGridPtr grid;    ///< null: the image does not act
    EdgeOptions options;  ///< later calls take the same K and range
    EdgeReport found;
    StepReport report;
};

/// g on the band of `u`, with room to move where it follows the surface.
[[nodiscard]] Edges find_edges(const Problem& problem, const StartFacts& start, const FloatGrid& u,
                               const EdgeOptions& options);

/// g on the band of `u` where that has moved beyond the one of `edges`; null where it has not.
[[nodiscard]] FloatGridPtr extended_edges(const Problem& problem, const StartFacts& start, const FloatGrid& u,
                                          const Edges& edges);

}  // namespace covol::pipeline
