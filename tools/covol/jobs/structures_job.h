#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "jobs/paint_reader.h"
#include "jobs/structure_inputs.h"
#include "jobs/structure_outputs.h"

// One image or a cloud without one; one or several structures.
namespace covol::tool {

/// What segment() and reconstruct() take, of one structure; and the part of its output that is known before.
struct PreparedStructure {
    StructureOutput output;
    std::vector<Vec3> points;
    SegmentOptions options;
    std::optional<Guess> guess;
};

/// Reads the structures' files, one structure after the other; they share one voxel size.
class StructurePreparer {
public:
    /// @param image   null: the only structure's points alone
    /// @param starts  in the structures' order
    StructurePreparer(const SegmentJob& job, const std::vector<StructureInput>& inputs, const Image* image,
                      const std::vector<StructureStart>& starts, Session& session);
    /// @throws UsageError where there are neither an image nor marks; Error.
    [[nodiscard]] PreparedStructure prepare(std::size_t n, const RunContext& run);
    /// All but the guess, which may be a whole label image.
    [[nodiscard]] PreparedStructure read_marks_of(std::size_t n, const RunContext& run);
    void add_guess(std::size_t n, PreparedStructure& prepared, const RunContext& run) const;
    /// @pre one has been prepared
    [[nodiscard]] double voxel_size() const { return voxel_size_.value(); }

private:
    const SegmentJob& job_;
    const std::vector<StructureInput>& inputs_;
    const Image* image_;
    const std::vector<StructureStart>& starts_;
    Session& session_;
    ImageGeometry geometry_;
    std::vector<std::string> grids_;
    PaintReader paint_;
    std::optional<double> voxel_size_;
};

/// How a structure is solved; the image is null for points alone.
using Solver =
    std::function<SegmentResult(const Image* image, const PreparedStructure& structure, const RunContext& run)>;
/// By segment() or reconstruct().
[[nodiscard]] SegmentResult solve_in_one_piece(const Image* image, const PreparedStructure& structure,
                                               const RunContext& run);

/// Solves each structure and separates them.
/// @param image   null: the only structure's points alone
/// @param starts  in the structures' order
/// @throws UsageError, Error as StructurePreparer; Error, with the structure's name, as segment().
[[nodiscard]] StructuresOutput segment_structures(const SegmentJob& job, const std::vector<StructureInput>& inputs,
                                                  const Image* image, const std::vector<StructureStart>& starts,
                                                  Session& session, const RunContext& run,
                                                  const Solver& solve = solve_in_one_piece);

/// The job from files to files.
void run_structures(const SegmentJob& job, Session& session, const Solver& solve = solve_in_one_piece);

}  // namespace covol::tool
