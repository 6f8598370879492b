#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "covol/point_structures.h"
#include "flags/bindings.h"
#include "flags/brick_flags.h"
#include "flags/checkpoint_flags.h"
#include "flags/cloud_flags.h"
#include "flags/contour_flags.h"
#include "flags/evidence_flags.h"
#include "flags/guess_flags.h"
#include "flags/painted_flags.h"
#include "flags/seed_flags.h"
#include "flags/vdb_flags.h"

namespace covol::tool {

/// Files whose marks name their structures. They are asked for twice, for the names and for the marks, and read once.
class SharedMarks {
public:
    /// @throws as read_structures_of_points()
    const std::vector<StructurePoints>& read(const std::string& file, const std::string& column,
                                             const ReadPointsOptions& options);

private:
    std::map<std::string, std::vector<StructurePoints>> read_;
};

/// What `segment` and `reconstruct` share: they differ in the image alone.
struct SegmentJob {
    std::vector<std::string> images;  ///< none: points alone; several: the frames of a time-lapse
    ImageFlags image;
    PointFlags points;
    ContourFlags contours;
    std::string structure_column;  ///< what names each mark's structure, in files of several; empty: files are of one
    std::shared_ptr<SharedMarks> shared = std::make_shared<SharedMarks>();
    PaintedFlags painted;
    SeedFlags seeds;
    GuessFlags guess;
    CloudFlags cloud;
    Given<SegmentOptions> given;
    std::string start_path;  ///< of the file that the start is read from; empty: it needs none
    std::vector<std::pair<std::string, Vec3>> named_seeds;  ///< outside one structure among several
    MeshFlags mesh;
    EvidenceFlags evidence;
    BrickFlags bricks;
    CheckpointFlags checkpoint;
    FrameChoice frames;
    std::string study;  ///< folder of a study, whose structures join those of the files; empty: none
    std::string output, mask_path, rtstruct_path, mesh_path, density_path, fields_path, table_path, failed_path,
        page_path, scene_path;
    VdbFlags vdb;

    void bind(CLI::App& command, bool with_image);
    /// Time-lapses by run_timelapse(), all else by run_structures(); behind `covol plan` run_plan(), behind `covol
    /// brick` run_bricks().
    void run(Session& session) const;

    // For those.
    /// --exterior-seed, whose places may belong to one structure.
    void bind_named_seeds(CLI::App& command);
    /// Without an image it is the study's. @throws UsageError: there is none
    void find_image();
    /// The study's, where the command line has none.
    void take_study_options();
    /// A mesh or a label image that stands at -o goes where --mesh and --mask would have it.
    void sort_output(bool with_image);
    [[nodiscard]] std::string any_output() const;
    [[nodiscard]] SegmentOptions resolve(double h) const;
    [[nodiscard]] MarksOptions marks_options(double h) const;
    [[nodiscard]] ReadMarksOptions reading(const RunContext& run) const;
    /// resolve_voxel_size() for a structure with these marks.
    /// @param geometry  that the marks belong to
    [[nodiscard]] double resolve_voxel_size(const Image* input_image, const Marks& marks,
                                            const std::optional<ImageGeometry>& geometry, Session& session) const;
    /// Whether an output, or what is done to the surface, needs its relaxed mesh.
    [[nodiscard]] bool needs_mesh() const;
    /// Options that are wrong whatever h is are found before anything is read.
    void check_options() const;
    /// Which of the given flags had nothing to do; empty where all had.
    [[nodiscard]] std::string unused(const SegmentReport& report) const;
    /// The image; the report tells of it.
    [[nodiscard]] Image read(const std::string& path, const ReadImageOptions& options, Session& session) const;
    /// How much of the image was read, once it has been segmented.
    static void report_chunks(const Image& image, Session& session);
};

}  // namespace covol::tool
