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
    std::optional<CorrectedMask> corrected;        ///< for --mask, if the guess is a mask with the image's geometry
    [[nodiscard]] const std::string& shown_name() const { return name.empty() ? grid : name; }
};

/// All structures of one image, disjoint.
struct StructuresOutput {
    ImageGeometry geometry;
    std::string image_path;      ///< empty: without an image
    std::optional<int> frame;    ///< time point in the file of the image, if one was chosen
    std::optional<Image> image;  ///< only if a report page is written
    bool is_anatomical = false;  ///< see is_anatomical()
    std::vector<StructureOutput> structures;
    std::vector<StructureOverlap> overlaps;
    [[nodiscard]] std::vector<std::string> names() const;
    [[nodiscard]] std::vector<int> labels() const;
};

/// The structures' surfaces.
[[nodiscard]] std::vector<Structure> solids(const StructuresOutput& output);

/// Whether --density and -o name the same file, which then contains both kinds of grids.
[[nodiscard]] bool is_density_in_output(const SegmentJob& job);
[[nodiscard]] std::string density_name(const StructuresOutput& output, const StructureOutput& structure);

/// Called for each output, with its path as named for this frame by NameTag, and the function that writes it. The path
/// is empty if the output is not requested.
using Sink = std::function<void(const std::string& path, std::function<void(const std::string& path)> write)>;
void queue_outputs(const SegmentJob& job, const std::shared_ptr<const StructuresOutput>& output, const NameTag& tagged,
                   Session& session, const Sink& sink);
/// Checks the names of the outputs. @throws Error as for Outputs::check().
void check_outputs(const SegmentJob& job, const std::vector<Marks>& structures, const NameTag& tagged,
                   Outputs& outputs);

/// {"structures": [...], "overlaps": [...]}, or the fields of a single structure without a name.
[[nodiscard]] Json to_json(const StructuresOutput& output);

/// The columns of the table of results; add_result() adds the values of a structure.
/// @param unit  of lengths, appended to column names in brackets: "volume (mm^3)"; empty: not known
[[nodiscard]] std::vector<std::string> result_columns(const std::string& unit);
void add_result(Table& table, const std::string& name, int label, const SegmentResult& result,
                const std::optional<IntensityStatistics>& intensity, const RunContext& run);

/// Statistics of the image inside the surface. Nullopt if more than `max_read` voxels of an image in chunks would have
/// to be read.
[[nodiscard]] std::optional<IntensityStatistics> intensity_within(const Image& image, const FloatGrid& surface,
                                                                  double max_read, const RunContext& run);

}  // namespace covol::tool
