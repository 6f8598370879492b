#pragma once
#include <vector>

#include "jobs/structure_inputs.h"
#include "jobs/structure_outputs.h"

// One image, one or several structures.
namespace covol::tool {

/// Segments each structure and separates them. The starts are in the structures' order.
[[nodiscard]] StructuresOutput segment_structures(const SegmentJob& job, const std::vector<StructureInput>& inputs,
                                                  const Image& image, const std::vector<StructureStart>& starts,
                                                  Session& session, const RunContext& run);

/// The job: one image, several structures, from files to files.
void run_structures(const SegmentJob& job, Session& session);

}  // namespace covol::tool
