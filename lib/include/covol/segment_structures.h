#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/evidence.h"
#include "covol/image.h"
#include "covol/marks.h"
#include "covol/motion.h"
#include "covol/pipeline.h"
#include "covol/structures.h"

namespace covol {

struct StructuresOptions {
    /// Options for every structure; contours, hints, seeds and guess are taken from its marks. An automatic voxel size
    /// is chosen by choose_voxel_size(), without an image from the first structure's marks, and used for all
    /// structures.
    SegmentOptions segment;
    MarksOptions marks;
};

/// The result of one structure.
struct StructureResult : StructureFacts {
    SegmentResult result;  ///< the name of the grid `surface` is StructureFacts::grid
    /// the guess that was corrected; its member `mask` is only kept if there is a single structure
    std::optional<GivenGuess> guess;
    std::optional<MotionReport> motion;  ///< motion since the previous frame, if the surface followed the image
};

struct StructuresResult {
    std::vector<StructureResult> structures;  ///< in the order of the marks
    std::vector<StructureOverlap> overlaps;   ///< the overlaps that were resolved
    double separate_seconds = 0;              ///< duration of separate() and the repeated measurements
};

/// Computes the surface of one structure. segment_structures() calls solve_structure() unless another function is
/// given, for example one that solves large structures in bricks.
using StructureSolver = std::function<SegmentResult(const std::optional<Image>& image, const StructureInput& structure,
                                                    const RunContext& run)>;
/// Calls segment(), or reconstruct() if there is no image.
[[nodiscard]] COVOL_API SegmentResult solve_structure(const std::optional<Image>& image,
                                                      const StructureInput& structure, const RunContext& run);

/// The automatic voxel size h. @param marks  of the first structure
[[nodiscard]] COVOL_API VoxelSizeChoice choose_voxel_size(const std::optional<Image>& image, const Marks& marks,
                                                          const SegmentOptions& options);

/// Segments the structures one after the other, makes them disjoint (separate()), and repeats the measurements of the
/// structures that this changed: mesh, fit, marks off the surface, seeds. All marks are prepared before the first
/// structure is solved.
/// @param image  none: a single structure from points alone
/// @throws Error as prepare_marks(), segment(), reconstruct() and separate(), with the structure's name.
[[nodiscard]] COVOL_API StructuresResult segment_structures(const std::optional<Image>& image, std::vector<Marks> marks,
                                                            const StructuresOptions& options = {},
                                                            const RunContext& run = {},
                                                            const StructureSolver& solve = solve_structure);

/// Segments the structures of a time-lapse, frame by frame. A surface obtained from marks and image without a flow
/// follows the image (SurfaceTemplate) and is corrected by the marks of the frame. A surface that was moved by a flow,
/// as in the paper's model, continues from its state in the last frame that was segmented successfully, with that
/// frame's weight of curvature unless the options give one: if the weight changed between frames, the surface would
/// appear to move.
class TimeLapse {
public:
    /// @param marks  marks of the same structures, in the same order, in all frames; after the first frame they may be
    /// empty
    /// @throws Error as segment_structures(); the next frame then continues from the last successful one.
    [[nodiscard]] COVOL_API StructuresResult segment(const Image& frame, std::vector<Marks> marks,
                                                     const StructuresOptions& options = {}, const RunContext& run = {});
    /// Whether a frame has been segmented.
    [[nodiscard]] bool started() const { return !last_.empty(); }

private:
    struct Last {
        std::string name;
        /// The surface from which the next frame continues. Without a flow this is SegmentResult::u: the extracted
        /// surface is redistanced, which would move its edges slightly in each frame. After a flow it is the extracted
        /// surface.
        FloatGridPtr surface;
        std::optional<double> delta;
        std::optional<SurfaceTemplate> look;  ///< the image around the surface; none if the surface was moved by a flow
    };
    std::vector<Last> last_;
};

/// Assesses a result by its marks and the image's edges. The reach of the marks is the attraction range or, if there
/// was no flow, the distance from the marks up to which the guess is expected to be accurate to a fourth of a voxel of
/// the image.
/// @param suggestions  number of slices to suggest
[[nodiscard]] COVOL_API Evidence assess_evidence(const SegmentResult& result, const std::vector<Vec3>& marks,
                                                 const Image& image, int suggestions, const RunContext& run = {});

}  // namespace covol
