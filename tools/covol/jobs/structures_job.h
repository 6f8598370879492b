#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/table.h"
#include "covol/structures.h"
#include "flags/evidence_flags.h"
#include "jobs/segment_job.h"

// One image, one or several structures: `--points NAME=FILE`, `--contours NAME=FILE`, labels of `--painted FILE`.
namespace covol::tool {

/// A structure as the command line gives it.
struct StructureInput {
    std::string name;  ///< empty: the only one, and it was not named
    PointFlags points;
    ContourFlags contours;
    std::vector<Vec3> exterior_seeds;
    SeedFlags seeds;    ///< without names
    std::string guess;  ///< another tool's result; empty: none
    /// Labels that were painted for it.
    struct Paint {
        std::shared_ptr<const PaintedFile> file;
        int label = 0;
    };
    std::vector<Paint> paint;
    int label = 0;  ///< in the mask that is written
};

/// The structures of a run, in the order in which their names come first: those of --points, --contours, --painted,
/// --guess, --inside. A single painted label without a name of its own belongs to marks that have none.
/// @throws UsageError when some marks have names and others have none, or a seed names nobody.
[[nodiscard]] std::vector<StructureInput> structures_of(const SegmentJob& job,
                                                        const std::vector<std::shared_ptr<const PaintedFile>>& painted = {});

/// What came out for one.
struct StructureOutput {
    std::string name, grid;
    std::vector<Vec3> marks;  ///< as they were clicked
    Json input;               ///< of the report
    SegmentResult result;
    std::optional<Evidence> evidence;
    int label = 0;                           ///< in the mask
    std::optional<CorrectedMask> corrected;  ///< of a guess that is a mask in the image's geometry
};

/// All structures of one image, disjoint.
struct StructuresOutput {
    ImageGeometry geometry;
    std::vector<StructureOutput> structures;
    Json overlaps = Json::array();
    [[nodiscard]] std::vector<std::string> names() const;
    [[nodiscard]] std::vector<int> labels() const;
};

/// How a structure starts. The curvature's weight that an earlier frame found automatically goes on where the command
/// line gives none: a surface that changed its stiffness between frames would seem to move.
struct StructureStart {
    Start start;
    double delta = -1;  ///< world units; < 0: automatic
};

/// Segments each structure and separates them. The starts are in the structures' order.
[[nodiscard]] StructuresOutput segment_structures(const SegmentJob& job, const std::vector<StructureInput>& inputs,
                                                  const Image& image, const std::vector<StructureStart>& starts, Session& session,
                                                  const RunContext& run);

/// The starts that --init asks for, one for each structure.
[[nodiscard]] std::vector<StructureStart> starts_of(const SegmentJob& job, const std::vector<StructureInput>& inputs);

/// One file for each output that was asked for, `tag` ("_t003", say) in front of their endings.
using Sink = std::function<void(const std::string& path, std::function<void(const std::string& path)> write)>;
void hand_over(const SegmentJob& job, const std::shared_ptr<const StructuresOutput>& output, const std::string& tag,
               Session& session, const Sink& sink);
/// Checks those names. @throws Error as Outputs::check().
void check_outputs(const SegmentJob& job, const std::vector<StructureInput>& inputs, const std::string& tag, Outputs& outputs);

/// {"structures": [...], "overlaps": [...]}, or the fields of the only one that has no name.
[[nodiscard]] Json to_json(const StructuresOutput& output);

/// The table's columns for a structure's result, and their values.
[[nodiscard]] std::vector<std::string> result_columns();
void add_result(Table& table, const std::string& name, int label, const SegmentReport& report);

/// "out.ply", "_ve" -> "out_ve.ply"; endings of two parts (.nii.gz, .seg.nrrd) stay whole.
[[nodiscard]] std::string with_suffix(const std::string& path, const std::string& suffix);

/// The job: one image, several structures, from files to files.
void run_structures(const SegmentJob& job, Session& session);

}  // namespace covol::tool
