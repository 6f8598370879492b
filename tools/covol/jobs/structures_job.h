#pragma once
#include <optional>
#include <vector>

#include "jobs/structure_inputs.h"
#include "jobs/structure_outputs.h"

// Runs a job with one or several structures on one image, or with a single structure on points or contours without an
// image.
namespace covol::tool {

/// Prepares the structures of one image for output: adds the requested evidence and corrected mask, and prints a
/// summary.
[[nodiscard]] StructuresOutput finish(const SegmentJob& job, StructuresResult result, const std::optional<Image>& image,
                                      Session& session, const RunContext& run);

/// Runs the job, from input files to output files.
void run_structures(const SegmentJob& job, Session& session, const StructureSolver& solve = solve_structure);

}  // namespace covol::tool
