#pragma once
#include <string>

#include "jobs/segment_job.h"

// Time-lapse: each frame starts from the one before.
namespace covol::tool {

/// "marks_{frame:03}.csv", 7 -> "marks_007.csv"; {frame} and {frame:03d} are understood too.
/// @throws UsageError when braces hold something else.
[[nodiscard]] std::string with_frame(const std::string& pattern, int frame);
[[nodiscard]] bool has_frame_pattern(const std::string& path);

/// Several images, or several frames of one.
[[nodiscard]] bool is_timelapse(const SegmentJob& job);

void run_timelapse(const SegmentJob& job, Session& session);

}  // namespace covol::tool
