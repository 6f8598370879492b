#pragma once
#include <optional>
#include <vector>

#include "jobs/structure_inputs.h"
#include "jobs/structure_outputs.h"

// Runs a job on one image or on a cloud without an image, with one or several structures.
namespace covol::tool {

/// Prepares the structures of one image for output: adds the requested evidence and corrected mask, and prints a
/// summary.
[[nodiscard]] StructuresOutput finish(const SegmentJob& job, StructuresResult result, const std::optional<Image>& image,
                                      Session& session, const RunContext& run);

/// Runs the job, from input files to output files.
void run_structures(const SegmentJob& job, Session& session, const StructureSolver& solve = solve_structure);

}  // namespace covol::tool
