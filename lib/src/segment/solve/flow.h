#pragma once
// Moves a start to where nothing moves any more, or lets the image move one that is the surface already.
#include <vector>

#include "segment/solve/fields.h"

namespace covol::pipeline {

/// A level set at rest, and how it came there.
struct Solution {
    StartFacts start;  ///< what it was made from
    FloatGridPtr u;    ///< of a cloud that rests its field, as StartSurface::u
    FloatGridPtr distance;
    Edges edges;
    EvolveReport solve;
    GuidanceReport guidance;
    bool was_requested = false;                      ///< the image, by guide()
    std::vector<SegmentReport::CoarseLevel> coarse;  ///< the coarsest first
    int coarse_levels = 0;
    StepReport report;

    [[nodiscard]] double h() const { return start.domain.voxel_size; }
    [[nodiscard]] bool has_vanished() const { return solve.stop_reason == StopReason::Vanished; }
};

/// What there is where a step fails, for SegmentFailed.
struct Reached {
    FloatGridPtr start, u, distance, edge;
};

/// Moves the start's level set, in place where it flows.
/// @param reached  kept up to date, or null
[[nodiscard]] Solution flow(const Problem& problem, StartSurface start, const EdgeOptions& edge,
                            Reached* reached = nullptr);

/// A level set that stays as it is.
[[nodiscard]] EvolveReport report_of_rest(const FloatGrid& u);

/// Whether the flow lost a start that was good by itself.
[[nodiscard]] bool has_lost(const Solution& solution, const FloatGrid& start);

/// @throws Error InvalidInput (the surface vanished).
void check_flow(const Problem& problem, const Choices& choices, Solution& solution);

}  // namespace covol::pipeline
