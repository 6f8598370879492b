#pragma once
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "covol/segment_structures.h"
#include "jobs/segment_job.h"

// Inputs of each structure on the command line: `--points NAME=FILE`, `--contours NAME=FILE`, labels of `--painted
// FILE`.
namespace covol::tool {

/// The structures of a run, in the order in which their names first occur in --points, --contours, --painted, --guess,
/// --inside. Their files are not read yet.
/// @throws UsageError if some marks have names and others have none, or if a seed has an unknown name.
[[nodiscard]] std::vector<Marks> structures_of(const SegmentJob& job,
                                               const std::vector<std::shared_ptr<const PaintedImage>>& painted = {});

/// Whether the marks of any file name their structures, with --structure-column or in a DICOM structure set.
[[nodiscard]] bool names_structures(const SegmentJob& job);

[[nodiscard]] std::vector<std::string> names_of(const std::vector<Marks>& structures);

/// Reads the start of --init from its file. With several structures, each gets its own grid of a .vdb.
/// @throws UsageError if several structures would start from one shape; Error if the file cannot be read.
void add_starts(const SegmentJob& job, std::vector<Marks>& structures, const RunContext& run);

/// Adds the marks and contours from files that name their structures, once the geometry of the image is known.
/// @returns the files of each structure, for reports
/// @throws Error if a file is invalid or cannot be read
std::map<std::string, MarkFiles> read_shared_files(const SegmentJob& job, std::vector<Marks>& structures,
                                                   const std::optional<ImageGeometry>& geometry, const RunContext& run);

/// Reads the structures' files, and chooses their common voxel size.
/// @throws UsageError if there are neither an image nor marks; Error if a file is invalid or cannot be read.
[[nodiscard]] StructuresOptions read_structures(const SegmentJob& job, std::vector<Marks>& structures,
                                                const std::optional<Image>& image, Session& session,
                                                const RunContext& run);

/// The inputs of segment() or reconstruct() for a single structure.
[[nodiscard]] StructureInput prepare_structure(const SegmentJob& job, std::vector<Marks> structures,
                                               const std::optional<Image>& image, Session& session,
                                               const RunContext& run);

}  // namespace covol::tool
