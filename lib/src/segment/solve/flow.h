#pragma once
// Evolves a start until it is steady. A start that is already the surface is only moved by the image.
#include <vector>

#include "segment/solve/fields.h"

namespace covol::pipeline {

/// The level set after the flow, and how it was obtained.
struct Solution {
    StartFacts start;  ///< the start that it was made from
    FloatGridPtr u;    ///< the level set; for a cloud that does not flow, its field as in StartSurface::u
    FloatGridPtr distance;
    Edges edges;
    EvolveReport solve;
    GuidanceReport guidance;
    bool was_requested = false;                      ///< whether guide() was called
    std::vector<SegmentReport::CoarseLevel> coarse;  ///< the coarsest first
    int coarse_levels = 0;
    StepReport report;

    [[nodiscard]] double h() const { return start.domain.voxel_size; }
    [[nodiscard]] bool has_vanished() const { return solve.stop_reason == StopReason::Vanished; }
};

/// The grids that exist when a step fails, for SegmentFailed.
struct Reached {
    FloatGridPtr start, u, distance, edge;
};

/// Evolves the start's level set, in place if it flows.
/// @param reached  receives the grids as they are made, or null
[[nodiscard]] Solution flow(const Problem& problem, StartSurface start, const EdgeOptions& edge,
                            Reached* reached = nullptr);

/// The report of a level set that does not move.
[[nodiscard]] EvolveReport steady_report(const FloatGrid& u);

/// Whether the flow made a usable start worse: the surface vanished, a grown start lost more than half of its volume,
/// or another start moved away from the trusted marks.
[[nodiscard]] bool has_lost(const Solution& solution, const FloatGrid& start);

/// Checks the result of the flow. @throws Error InvalidInput (the surface vanished).
void check_flow(const Problem& problem, const Choices& choices, Solution& solution);

}  // namespace covol::pipeline
