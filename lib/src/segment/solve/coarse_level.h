#pragma once
// Coarse to fine. The way from the start is long in voxels of h. In voxels of 2h a step costs a quarter and goes twice
// as far; what is left to do at h is near the surface that the coarse level finds.
#include "segment/solve/flow.h"

namespace covol::pipeline {

/// The end of the flow on coarse levels, as a start on the fine lattice.
struct CoarsePass {
    int levels = 0;                                   ///< that were asked for
    FloatGridPtr u;                                   ///< null: there is none, or it is of no use, which is reported
    std::vector<SegmentReport::CoarseLevel> reports;  ///< the coarsest first
    StepReport report;
};

/// Passes the coarse levels that the options ask for.
[[nodiscard]] CoarsePass pass_coarse_levels(const Problem& problem, const StartSurface& start, const EdgeOptions& edge);

/// `start`, with u the end of the flow on a coarser level.
[[nodiscard]] StartSurface from_coarse_level(StartSurface start, const FloatGridPtr& u);

}  // namespace covol::pipeline
