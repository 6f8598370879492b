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
    /// For every structure; contours, hints, seeds and guess are those of its marks. An automatic voxel size is that of
    /// choose_voxel_size(), without an image from the first structure's marks; all structures share it.
    SegmentOptions segment;
    MarksOptions marks;
};

/// The result of one structure.
struct StructureResult : StructureFacts {
    SegmentResult result;  ///< its surface has the name `grid`
    /// the guess that was corrected; with its mask only if there is a single structure
    std::optional<GivenGuess> guess;
    std::optional<MotionReport> motion;  ///< from the previous frame, for a surface that followed the image
};

struct StructuresResult {
    std::vector<StructureResult> structures;  ///< in the order of the marks
    std::vector<StructureOverlap> overlaps;   ///< those that were resolved
    double separate_seconds = 0;
};

/// How one structure is solved: by default by segment() or reconstruct().
using StructureSolver = std::function<SegmentResult(const std::optional<Image>& image, const StructureInput& structure,
                                                    const RunContext& run)>;
[[nodiscard]] COVOL_API SegmentResult solve_structure(const std::optional<Image>& image,
                                                      const StructureInput& structure, const RunContext& run);

/// h if the options do not give it. @param marks  of the first structure
[[nodiscard]] COVOL_API VoxelSizeChoice choose_voxel_size(const std::optional<Image>& image, const Marks& marks,
                                                          const SegmentOptions& options);

/// Segments the structures one after the other, makes them disjoint (separate()), and repeats the measurements of those
/// that this changed: mesh, fit, marks off the surface, seeds. All marks are prepared before the first structure is
/// solved.
/// @param image  none: a single structure from points alone
/// @throws Error as prepare_marks(), segment(), reconstruct() and separate(), with the structure's name.
[[nodiscard]] COVOL_API StructuresResult segment_structures(const std::optional<Image>& image, std::vector<Marks> marks,
                                                            const StructuresOptions& options = {},
                                                            const RunContext& run = {},
                                                            const StructureSolver& solve = solve_structure);

/// A time-lapse: the structures of one frame after the other. A surface obtained from marks and image follows the image
/// (SurfaceTemplate), and is corrected by the frame's own marks. A surface that flowed, as in the paper's model,
/// continues from its state in the last frame that could be segmented, with the weight of curvature chosen there unless
/// the options give one: a surface whose stiffness changed between frames would appear to move.
class TimeLapse {
public:
    /// @param marks  of the same structures, in the same order, in all frames; after the first frame they may be empty
    /// @throws Error as segment_structures(); the next frame then continues from the one before.
    [[nodiscard]] COVOL_API StructuresResult segment(const Image& frame, std::vector<Marks> marks,
                                                     const StructuresOptions& options = {}, const RunContext& run = {});
    /// Whether a frame has been segmented.
    [[nodiscard]] bool started() const { return !last_.empty(); }

private:
    struct Last {
        std::string name;
        FloatGridPtr surface;  ///< not a distance if it did not flow: redistancing would move its edges slightly
        std::optional<double> delta;
        std::optional<SurfaceTemplate> look;  ///< of a surface that did not flow
    };
    std::vector<Last> last_;
};

/// Assesses a result by its marks and the image's edges. The reach of the marks is that of the points' attraction, or,
/// if nothing flowed, the distance up to which the surface through them is accurate to a fourth of a voxel of the
/// image, independently of the voxel size.
/// @param suggestions  number of slices to suggest
[[nodiscard]] COVOL_API Evidence assess_evidence(const SegmentResult& result, const std::vector<Vec3>& marks,
                                                 const Image& image, int suggestions, const RunContext& run = {});

}  // namespace covol
