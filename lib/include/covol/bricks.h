#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/edge.h"
#include "covol/evolve.h"
#include "covol/image.h"
#include "covol/options_table.h"
#include "covol/pipeline.h"

// A job in parts: the surface is found brick by brick, each on its own machine or one after the other, and joined.
//
// A coarse solve of the whole gives every brick its start. A brick is solved with some layers of its neighbours around
// it; what they found last holds the outermost of these (the alternating method of Schwarz, 1870, all bricks at once:
// Lions, On the Schwarz alternating method, 1988). Sweeps repeat until neighbours agree where they meet. All bricks lie
// on one lattice and each leaf of it belongs to one of them, so that the joined level set is a union of leaves; beside
// a seam its values are the two states' weighted mean.
namespace covol {

struct BrickOptions {
    std::int64_t max_voxels = 8'000'000;  ///< > 0: of the band in a brick, its neighbours' layers not counted
    int overlap = 16;                     ///< voxels, a multiple of 8, 8 to 2^23: layers of its neighbours
    double tolerance = 0.05;              ///< voxels, > 0: neighbours agree when their surfaces lie closer
    int max_sweeps = 4;                   ///< >= 1
};

template <>
inline constexpr auto kOptions<BrickOptions> = std::tuple{
    Option{"brick_voxels", &BrickOptions::max_voxels, kPositive},
    Option{"brick_overlap", &BrickOptions::overlap, counted_in(Unit::Voxels, between(8, 1 << 23)), Group::Numerics,
           "layers of its neighbours around a brick, a multiple of 8"},
    Option{"seam_tolerance", &BrickOptions::tolerance, counted_in(Unit::Voxels, kPositive), Group::Numerics,
           "sweeps over the bricks end when neighbours' surfaces lie closer than this, voxels"},
    Option{"most_sweeps", &BrickOptions::max_sweeps, at_least(1)},
    Rule<BrickOptions>{"brick_overlap", "a multiple of 8", [](const BrickOptions& o) { return o.overlap % 8 == 0; }}};

struct Brick {
    VoxelBox core;  ///< the voxels of the lattice that belong to it: whole leaves, cut at the domain's end
    std::int64_t active_voxels = 0;       ///< of the band in it, by the coarse solve
    std::vector<std::size_t> neighbours;  ///< bricks whose cores come within `overlap` of its own
};

/// What all bricks have in common.
struct BrickPlan {
    BrickOptions options;
    Domain domain;        ///< of the whole
    EdgeOptions edge;     ///< what g means, fixed for all bricks
    FloatGridPtr coarse;  ///< a level set on a coarser lattice
    std::vector<Brick> bricks;
    bool has_sweeps = true;  ///< else each brick is what it is, whatever its neighbours are
    [[nodiscard]] COVOL_API std::int64_t active_voxels() const;
};

struct SolvedBrick {
    FloatGridPtr state;  ///< no leaf where no surface passes it
    StopReason stop_reason = StopReason::NotRun;
    int steps = 0;
    std::int64_t active_voxels = 0;
    double seconds = 0;
};

/// The last state of a brick: the level set on the leaves of its core and one layer of leaves around; null: there is
/// none yet.
using BrickStates = std::function<FloatGridPtr(std::size_t brick)>;

/// A segmentation or reconstruction that is done in bricks. Of points with an image that are tagged, of clouds, and of
/// the starts that flow; not of guesses and contours, whose surface rests on all marks at once.
class BrickJob {
public:
    /// Chooses what is left to be chosen; of a cloud that takes its orientation.
    /// @throws Error as segment() and reconstruct(); Unsupported where the job can't be done in bricks
    COVOL_API BrickJob(const Image& image, const std::vector<Vec3>& points, const SegmentOptions& options,
                       const RunContext& run);
    COVOL_API BrickJob(const std::vector<Vec3>& points, const SegmentOptions& options, const RunContext& run);
    COVOL_API ~BrickJob();
    BrickJob(const BrickJob&) = delete;
    BrickJob& operator=(const BrickJob&) = delete;

    /// Solves the whole coarsely and splits it. @throws Error as segment() and reconstruct(), InvalidOptions.
    [[nodiscard]] COVOL_API BrickPlan plan(const BrickOptions& options) const;
    /// One sweep of one brick, from its own and its neighbours' last states, or from the coarse solve where `states`
    /// has none. @throws Error InvalidInput (a plan of a job with
    /// another voxel size)
    [[nodiscard]] COVOL_API SolvedBrick solve(const BrickPlan& plan, std::size_t brick,
                                              const BrickStates& states) const;
    /// Joins the states of all bricks and finishes the surface as segment() does.
    /// @param without_mesh  as SegmentOptions::without_mesh, where that is not set already
    /// @throws Error InvalidInput (no surface is left)
    [[nodiscard]] COVOL_API SegmentResult join(const BrickPlan& plan, const BrickStates& states,
                                               bool without_mesh = false) const;

private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

/// How far apart a brick's surface and those of its neighbours lie where both know them, at most, voxels.
[[nodiscard]] COVOL_API double measure_seams(const BrickPlan& plan, std::size_t brick, const BrickStates& states);

}  // namespace covol
