#pragma once
#include <optional>
#include <vector>

#include "jobs/structure_inputs.h"
#include "jobs/structure_outputs.h"

// One image or a cloud without one; one or several structures.
namespace covol::tool {

/// The structures of one image as they go to files: with the evidence and the corrected mask that were asked for. Tells
/// of them.
[[nodiscard]] StructuresOutput finish(const SegmentJob& job, StructuresResult result, const std::optional<Image>& image,
                                      Session& session, const RunContext& run);

/// The job from files to files.
void run_structures(const SegmentJob& job, Session& session, const StructureSolver& solve = solve_structure);

}  // namespace covol::tool
