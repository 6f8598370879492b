#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "covol/segment_structures.h"
#include "jobs/segment_job.h"

// What the command line gives for each structure: `--points NAME=FILE`, `--contours NAME=FILE`, labels of `--painted
// FILE`.
namespace covol::tool {

/// The structures of a run, in the order in which their names come first: those of --points, --contours, --painted,
/// --guess, --inside. Their files are not read yet.
/// @throws UsageError when some marks have names and others have none, or a seed names nobody.
[[nodiscard]] std::vector<Marks> structures_of(const SegmentJob& job,
                                               const std::vector<std::shared_ptr<const PaintedImage>>& painted = {});

/// Whether the marks of some file name their structures: --structure-column, and structure sets of DICOM.
[[nodiscard]] bool names_structures(const SegmentJob& job);

[[nodiscard]] std::vector<std::string> names_of(const std::vector<Marks>& structures);

/// Reads the file of --init; of several structures each gets its own grid of a .vdb.
/// @throws UsageError where several structures have one shape; Error.
void add_starts(const SegmentJob& job, std::vector<Marks>& structures, const RunContext& run);

/// Reads the structures' files, and chooses the voxel size that they share.
/// @throws UsageError where there are neither an image nor marks; Error.
[[nodiscard]] StructuresOptions read_structures(const SegmentJob& job, std::vector<Marks>& structures,
                                                const std::optional<Image>& image, Session& session,
                                                const RunContext& run);

/// What segment() and reconstruct() take of the only structure.
[[nodiscard]] StructureInput prepare_structure(const SegmentJob& job, std::vector<Marks> structures,
                                               const std::optional<Image>& image, Session& session,
                                               const RunContext& run);

}  // namespace covol::tool
