#pragma once
// Coarse to fine: the way from the start is long in voxels of h. In voxels of 2h a step costs a quarter and goes twice
// as far; at h only the remaining way from the surface of the coarse level is computed.
#include "segment/solve/flow.h"

namespace covol::pipeline {

/// The end of the flow on coarse levels, as a start on the fine lattice.
struct CoarsePass {
    int levels = 0;                                   ///< requested
    FloatGridPtr u;                                   ///< null if there is none, or it is not usable, which is reported
    std::vector<SegmentReport::CoarseLevel> reports;  ///< the coarsest first
    StepReport report;
};

/// Solves the coarse levels that the options request.
[[nodiscard]] CoarsePass pass_coarse_levels(const Problem& problem, const StartSurface& start, const EdgeOptions& edge);

/// `start` with its u replaced by the end of the flow on a coarser level.
[[nodiscard]] StartSurface from_coarse_level(StartSurface start, const FloatGridPtr& u);

}  // namespace covol::pipeline
