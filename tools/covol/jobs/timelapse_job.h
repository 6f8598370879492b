#pragma once
#include "jobs/segment_job.h"

// Time-lapse: each frame starts from the result of the previous one.
namespace covol::tool {

/// Whether the job has several images, or several frames of one image.
[[nodiscard]] bool is_timelapse(const SegmentJob& job);

void run_timelapse(const SegmentJob& job, Session& session);

}  // namespace covol::tool
