#pragma once
#include "jobs/segment_job.h"
#include "jobs/structures_job.h"

// The commands segment and reconstruct in bricks.
namespace covol::tool {

/// Runs the step that `covol brick` requests. @throws UsageError for several structures or frames
void run_bricks(const SegmentJob& job, Session& session);

/// Solves the structure in one piece. If the coarse solution shows that this exceeds --memory-limit, it is solved in
/// bricks, one after the other, whose states are stored in a temporary folder in the folder of the output.
[[nodiscard]] SegmentResult solve_within_limit(const SegmentJob& job, const std::optional<Image>& image,
                                               const StructureInput& structure, Session& session,
                                               const RunContext& run);

}  // namespace covol::tool
