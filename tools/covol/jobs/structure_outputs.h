#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/output/table.h"
#include "covol/intensity.h"
#include "covol/segment_structures.h"
#include "flags/evidence_flags.h"
#include "jobs/name_tag.h"
#include "jobs/segment_job.h"
#include "jobs/structure_inputs.h"

// The result of each structure, and the files and reports that it is written to.
namespace covol::tool {

/// The result of one structure.
struct StructureOutput : StructureResult {
    std::optional<Evidence> evidence;
    std::optional<IntensityStatistics> intensity;  ///< inside the surface
    std::optional<CorrectedMask> corrected;        ///< for a guess that is a mask in the image's geometry
    [[nodiscard]] const std::string& shown_name() const { return name.empty() ? grid : name; }
};

/// All structures of one image, disjoint.
struct StructuresOutput {
    ImageGeometry geometry;
    std::string image_path;      ///< empty: without an image
    std::optional<int> frame;    ///< of that file, if one was chosen
    std::optional<Image> image;  ///< for the report page
    bool is_anatomical = false;  ///< of that image
    std::vector<StructureOutput> structures;
    std::vector<StructureOverlap> overlaps;
    [[nodiscard]] std::vector<std::string> names() const;
    [[nodiscard]] std::vector<int> labels() const;
};

/// The structures' surfaces.
[[nodiscard]] std::vector<Structure> solids(const StructuresOutput& output);

/// --density and -o have the same name: one file contains both kinds of grids.
[[nodiscard]] bool is_density_in_output(const SegmentJob& job);
[[nodiscard]] std::string density_name(const StructuresOutput& output, const StructureOutput& structure);

/// Takes each requested output with its tagged name.
using Sink = std::function<void(const std::string& path, std::function<void(const std::string& path)> write)>;
void queue_outputs(const SegmentJob& job, const std::shared_ptr<const StructuresOutput>& output, const NameTag& tagged,
                   Session& session, const Sink& sink);
/// Checks these names. @throws Error as Outputs::check().
void check_outputs(const SegmentJob& job, const std::vector<Marks>& structures, const NameTag& tagged,
                   Outputs& outputs);

/// {"structures": [...], "overlaps": [...]}, or the fields of the only one that has no name.
[[nodiscard]] Json to_json(const StructuresOutput& output);

/// The table's columns for the result of a structure, and their values.
/// @param unit  of lengths, appended to column names in brackets: "volume (mm^3)"; empty: not known
[[nodiscard]] std::vector<std::string> result_columns(const std::string& unit);
void add_result(Table& table, const std::string& name, int label, const SegmentResult& result,
                const std::optional<IntensityStatistics>& intensity, const RunContext& run);

/// For an image in chunks, nullopt if more than `max_read` voxels would have to be read.
[[nodiscard]] std::optional<IntensityStatistics> intensity_within(const Image& image, const FloatGrid& surface,
                                                                  double max_read, const RunContext& run);

}  // namespace covol::tool
