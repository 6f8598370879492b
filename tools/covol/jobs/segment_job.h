#pragma once
#include <map>
#include <memory>
#include <optional>
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

/// Reads files in which each mark states its structure. A file is needed twice, for the names of the structures and for
/// the marks, but is read only once.
class SharedMarks {
public:
    /// @throws Error as for read_structures_of_points()
    const std::vector<StructurePoints>& read(const std::string& file, const std::string& column,
                                             const ReadPointsOptions& options);

private:
    std::map<std::string, std::vector<StructurePoints>> read_;
};

/// The commands `segment` and `reconstruct`, which differ only in the image.
struct SegmentJob {
    std::vector<std::string> images;  ///< none: points only; several: the frames of a time-lapse
    ImageFlags image;
    PointFlags points;
    ContourFlags contours;
    /// Column with the structure of each mark; empty: a file has one structure, unless it is a DICOM structure set.
    std::string structure_column;
    std::shared_ptr<SharedMarks> shared = std::make_shared<SharedMarks>();
    PaintedFlags painted;
    SeedFlags seeds;
    GuessFlags guess;
    CloudFlags cloud;
    Given<SegmentOptions> given;
    std::string start_path;  ///< file that the start is read from; empty: no file is needed
    std::vector<std::pair<std::string, Vec3>> named_seeds;  ///< name, position; --exterior-seed NAME:X,Y,Z
    MeshFlags mesh;
    EvidenceFlags evidence;
    BrickFlags bricks;
    CheckpointFlags checkpoint;
    FrameChoice frames;
    std::string study;  ///< folder of a study whose structures are added to those of the files; empty: none
    std::string output, mask_path, rtstruct_path, mesh_path, density_path, fields_path, table_path, failed_path,
        page_path, scene_path;
    std::optional<int> mask_label;  ///< value of the only structure in --mask; automatic: see number_labels()
    VdbFlags vdb;

    void bind(CLI::App& command, bool with_image);
    /// Calls run_plan() after `covol plan`, run_bricks() after `covol brick`, run_timelapse() for time-lapses, and
    /// otherwise run_structures().
    void run(Session& session) const;

    // Used by run() and the functions that it calls:
    /// Adds --exterior-seed, which accepts positions for all structures and, as NAME:X,Y,Z, for a single one.
    void bind_named_seeds(CLI::App& command);
    /// Uses the study's image if the command line names no image. @throws UsageError if there is no study, either
    void find_image();
    /// Uses the study's options that the command line does not give.
    void take_study_options();
    /// Treats a mesh or a label image at -o as an argument of --mesh or --mask.
    void sort_output(bool with_image);
    [[nodiscard]] std::string any_output() const;
    [[nodiscard]] SegmentOptions resolve(double h) const;
    [[nodiscard]] MarksOptions marks_options(double h) const;
    [[nodiscard]] ReadMarksOptions reading(const RunContext& run) const;
    /// resolve_voxel_size() for a structure with these marks.
    /// @param geometry  the lattice that the marks refer to
    [[nodiscard]] double resolve_voxel_size(const Image* input_image, const Marks& marks,
                                            const std::optional<ImageGeometry>& geometry, Session& session) const;
    /// Whether an output, or the processing of the surface, needs its relaxed mesh.
    [[nodiscard]] bool needs_mesh() const;
    /// Checks, before the image is read, for options that are invalid for every voxel size. @throws UsageError, Error
    void check_options() const;
    /// Like check_options(), for a job in bricks: options of a mesh are accepted without a mesh, because another step
    /// of the job may write it.
    void check_settings() const;
    /// A warning that names the given flags that had no effect; empty if all had an effect.
    [[nodiscard]] std::string unused(const SegmentReport& report) const;
    /// Reads the image, and adds it to the report.
    [[nodiscard]] Image read(const std::string& path, const ReadImageOptions& options, Session& session) const;
    /// Adds to the report how much of the image was read; called after the segmentation.
    static void report_chunks(const Image& image, Session& session);
};

}  // namespace covol::tool
