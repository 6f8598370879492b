#pragma once
#include <vector>

#include "jobs/structure_inputs.h"
#include "jobs/structure_outputs.h"

// One image or a cloud without one; one or several structures.
namespace covol::tool {

/// Segments each structure and separates them.
/// @param image   null: the only structure's points alone
/// @param starts  in the structures' order
/// @throws UsageError where there are neither an image nor marks; Error, with the structure's name, as segment().
[[nodiscard]] StructuresOutput segment_structures(const SegmentJob& job, const std::vector<StructureInput>& inputs,
                                                  const Image* image, const std::vector<StructureStart>& starts,
                                                  Session& session, const RunContext& run);

/// The job from files to files.
void run_structures(const SegmentJob& job, Session& session);

}  // namespace covol::tool
