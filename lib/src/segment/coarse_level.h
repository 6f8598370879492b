#pragma once
// Coarse to fine. The way from the start is long in voxels of h. In voxels of 2h a step costs a quarter and goes twice
// as far; what is left to do at h is near the surface that the coarse level finds.
#include <optional>

#include "segment/job.h"

namespace covol::pipeline {

/// What a job goes on with where its coarse level is of no use after all.
struct FineStart {
    FloatGridPtr u;
    EdgeOptions edge;
    StartOrigin origin;
};

/// Replaces the start by the end of the flow on the coarse levels that the options ask for.
/// @return what was replaced; none where there is no coarse level or its result is of no use, which is reported
std::optional<FineStart> pass_coarse_levels(Job& job);

/// Goes back to the start itself.
void leave_out_coarse_level(Job& job, const FineStart& start);

}  // namespace covol::pipeline
