#pragma once
#include "jobs/segment_job.h"
#include "jobs/structures_job.h"

// A segment or reconstruct in bricks.
namespace covol::tool {

/// What `covol brick` asks for. @throws UsageError for several structures or frames
void run_bricks(const SegmentJob& job, Session& session);

/// In one piece; where the coarse solve says that this takes more than --memory-limit, in bricks, one after the other,
/// in a folder beside the output that is gone at the end.
[[nodiscard]] SegmentResult solve_within_limit(const SegmentJob& job, const std::optional<Image>& image,
                                               const StructureInput& structure, Session& session,
                                               const RunContext& run);

}  // namespace covol::tool
