#pragma once
#include "jobs/segment_job.h"

// `covol plan`: what a segmentation would read, hold and take.
namespace covol::tool {

/// Runs the marks alone on two coarse lattices, and says what follows for the job's own voxel size: a band's voxels
/// grow as 1/h^2, and so do time and memory. Of the image only the header is read. Writes no file but the report
/// (`plan`).
/// @throws Error InvalidInput (no marks), UsageError (several images).
void run_plan(const SegmentJob& job, Session& session);

}  // namespace covol::tool
