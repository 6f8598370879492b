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
    /// Of every structure; contours, hints, seeds and guess are those of its marks. An automatic voxel size is that of
    /// choose_voxel_size(), of the first structure's marks where there is no image; all structures share it.
    SegmentOptions segment;
    MarksOptions marks;
};

/// What came of one structure.
struct StructureResult : StructureFacts {
    SegmentResult result;                ///< its surface has the name `grid`
    std::optional<GivenGuess> guess;     ///< that was corrected; its mask only if the structure is the only one
    std::optional<MotionReport> motion;  ///< from the frame before, of a surface that followed the image
};

struct StructuresResult {
    std::vector<StructureResult> structures;  ///< in the order of the marks
    std::vector<StructureOverlap> overlaps;   ///< that were resolved
    double separate_seconds = 0;
};

/// How one structure is solved: by segment() or reconstruct(), where nothing else is given.
using StructureSolver = std::function<SegmentResult(const std::optional<Image>& image, const StructureInput& structure,
                                                    const RunContext& run)>;
[[nodiscard]] COVOL_API SegmentResult solve_structure(const std::optional<Image>& image,
                                                      const StructureInput& structure, const RunContext& run);

/// h where the options leave it open. @param marks  of the first structure
[[nodiscard]] COVOL_API VoxelSizeChoice choose_voxel_size(const std::optional<Image>& image, const Marks& marks,
                                                          const SegmentOptions& options);

/// Segments the structures one after the other, makes them disjoint (separate()), and measures those again that this
/// changed: mesh, fit, marks off the surface, seeds. All marks are prepared before the first is solved.
/// @param image  none: the only structure's points alone
/// @throws Error as prepare_marks(), segment(), reconstruct() and separate(), with the structure's name.
[[nodiscard]] COVOL_API StructuresResult segment_structures(const std::optional<Image>& image, std::vector<Marks> marks,
                                                            const StructuresOptions& options = {},
                                                            const RunContext& run = {},
                                                            const StructureSolver& solve = solve_structure);

/// A time-lapse: the structures of one frame after the other. A surface that marks and image gave follows the image
/// (SurfaceTemplate), and is corrected by the frame's own marks; one that flowed, as the paper's model does, flows on
/// from its surface in the last frame that could be segmented, with the weight of curvature that was chosen there,
/// where the options leave it open: a surface that changed its stiffness between frames would seem to move.
class TimeLapse {
public:
    /// @param marks  of the same structures, in the same order, in all frames; once there is a frame they may be empty
    /// @throws Error as segment_structures(); the next frame goes on from the one before.
    [[nodiscard]] COVOL_API StructuresResult segment(const Image& frame, std::vector<Marks> marks,
                                                     const StructuresOptions& options = {}, const RunContext& run = {});
    /// Whether a frame has been segmented.
    [[nodiscard]] bool started() const { return !last_.empty(); }

private:
    struct Last {
        std::string name;
        FloatGridPtr surface;  ///< not a distance, where it did not flow: making it one moves its edges a little
        std::optional<double> delta;
        std::optional<SurfaceTemplate> look;  ///< of a surface that did not flow
    };
    std::vector<Last> last_;
};

/// Judges a result by its marks and the image's edges. The marks reach as far as the points' attraction does, or, where
/// nothing flowed, as far as the surface through them is right to a fourth of a voxel of the image: whatever the voxel
/// size is.
/// @param suggestions  how many slices to name
[[nodiscard]] COVOL_API Evidence assess_evidence(const SegmentResult& result, const std::vector<Vec3>& marks,
                                                 const Image& image, int suggestions, const RunContext& run = {});

}  // namespace covol
