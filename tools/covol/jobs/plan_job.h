#pragma once
#include "jobs/segment_job.h"

// `covol plan`: estimates what a segmentation would read, and its memory and time.
namespace covol::tool {

/// Solves for the marks without the image on two coarse lattices, and extrapolates to the job's voxel size h: the
/// number of voxels in a band, the time and the memory grow as 1/h^2. Only the header of the image is read. Writes no
/// file except the report (`plan`).
/// @throws Error InvalidInput (no marks), UsageError (several images).
void run_plan(const SegmentJob& job, Session& session);

}  // namespace covol::tool
