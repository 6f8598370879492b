#pragma once
// Coarse to fine: a start far from the result needs many steps on voxels of size h. On voxels of size 2h a step costs a
// quarter and moves the surface twice as far; on the fine lattice the flow continues from that result.
#include "segment/solve/flow.h"

namespace covol::pipeline {

/// The end of the flow on coarse levels, as a start on the fine lattice.
struct CoarsePass {
    int levels = 0;                                   ///< number of levels requested
    FloatGridPtr u;                                   ///< null if no level was solved, or its surface vanished
    std::vector<SegmentReport::CoarseLevel> reports;  ///< the coarsest first
    StepReport report;
};

/// Solves the coarse levels that the options request.
[[nodiscard]] CoarsePass pass_coarse_levels(const Problem& problem, const StartSurface& start, const EdgeOptions& edge);

/// `start` with its u replaced by the end of the flow on a coarser level.
[[nodiscard]] StartSurface from_coarse_level(StartSurface start, const FloatGridPtr& u);

}  // namespace covol::pipeline
