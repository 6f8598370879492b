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

// A computation in parts: the surface is solved brick by brick, on separate machines or one after the other, and
// joined.
//
// A coarse solve of the whole domain gives every brick its start. A brick is solved together with some layers of its
// neighbours; the outermost of these layers are fixed to the neighbours' last results (the alternating method of
// Schwarz, 1870; for all bricks at once: Lions, On the Schwarz alternating method, 1988). Sweeps repeat until
// neighbours agree where they meet. All bricks lie on one lattice and each leaf of it belongs to one of them, so that
// the joined level set is a union of leaves; near a seam its values are the weighted mean of the two states.
namespace covol {

struct BrickOptions {
    std::int64_t max_voxels = 8'000'000;  ///< > 0: of the band in a brick, without its neighbours' layers
    int overlap = 16;                     ///< voxels, a multiple of 8, 8 to 2^23: width of the neighbours' layers
    double tolerance = 0.05;              ///< voxels, > 0: neighbours agree if their surfaces are closer than this
    int max_sweeps = 4;                   ///< >= 1
};

template <>
inline constexpr auto kOptions<BrickOptions> = std::tuple{
    Option{"brick_voxels", &BrickOptions::max_voxels, kPositive},
    Option{"brick_overlap", &BrickOptions::overlap, counted_in(Unit::Voxels, between(8, 1 << 23)), Group::Numerics,
           "layers of the neighbouring bricks' voxels around a brick, a multiple of 8"},
    Option{"seam_tolerance", &BrickOptions::tolerance, counted_in(Unit::Voxels, kPositive), Group::Numerics,
           "sweeps over the bricks end when the surfaces of neighbours differ by less than this, in voxels"},
    Option{"most_sweeps", &BrickOptions::max_sweeps, at_least(1)},
    Rule<BrickOptions>{"brick_overlap", "a multiple of 8", [](const BrickOptions& o) { return o.overlap % 8 == 0; }}};

struct Brick {
    VoxelBox core;  ///< voxels of the lattice that belong to it: whole leaves, cut off at the domain's end
    std::int64_t active_voxels = 0;       ///< of the band in it, from the coarse solve
    std::vector<std::size_t> neighbours;  ///< bricks whose cores come within `overlap` of its own
};

/// What all bricks have in common.
struct BrickPlan {
    BrickOptions options;
    Domain domain;        ///< of the whole
    EdgeOptions edge;     ///< parameters of g, the same for all bricks
    FloatGridPtr coarse;  ///< a level set on a coarser lattice
    std::vector<Brick> bricks;
    bool has_sweeps = true;  ///< false: each brick is solved once, independently of its neighbours
    [[nodiscard]] COVOL_API std::int64_t active_voxels() const;
};

struct SolvedBrick {
    FloatGridPtr state;  ///< has no leaves if no surface passes through the brick
    StopReason stop_reason = StopReason::NotRun;
    int steps = 0;
    std::int64_t active_voxels = 0;
    double seconds = 0;
};

/// The last state of a brick: the level set on the leaves of its core and one layer of leaves around it; null if there
/// is none yet.
using BrickStates = std::function<FloatGridPtr(std::size_t brick)>;

/// A segmentation or reconstruction that is computed in bricks: of points with an image that are tagged, of clouds, and
/// of starts that flow; not of guesses and contours, whose surface depends on all marks at once.
class BrickJob {
public:
    /// Makes the remaining automatic choices; for a cloud this includes its orientation.
    /// @throws Error as segment() and reconstruct(); Unsupported if the job cannot be done in bricks
    COVOL_API BrickJob(const Image& image, const std::vector<Vec3>& points, const SegmentOptions& options,
                       const RunContext& run);
    COVOL_API BrickJob(const std::vector<Vec3>& points, const SegmentOptions& options, const RunContext& run);
    COVOL_API ~BrickJob();
    BrickJob(const BrickJob&) = delete;
    BrickJob& operator=(const BrickJob&) = delete;

    /// Solves the whole domain coarsely and splits it. @throws Error as segment() and reconstruct(), InvalidOptions.
    [[nodiscard]] COVOL_API BrickPlan plan(const BrickOptions& options) const;
    /// One sweep of one brick, from its own and its neighbours' last states, or from the coarse solve if `states` has
    /// none.
    /// @throws Error InvalidInput (a plan of a job with another voxel size)
    [[nodiscard]] COVOL_API SolvedBrick solve(const BrickPlan& plan, std::size_t brick,
                                              const BrickStates& states) const;
    /// Joins the states of all bricks and finishes the surface as segment() does.
    /// @param without_mesh  as SegmentOptions::without_mesh, if that is not set already
    /// @throws Error InvalidInput (no surface remains)
    [[nodiscard]] COVOL_API SegmentResult join(const BrickPlan& plan, const BrickStates& states,
                                               bool without_mesh = false) const;

private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

/// The maximum distance, in voxels, between a brick's surface and those of its neighbours where both are known.
[[nodiscard]] COVOL_API double measure_seams(const BrickPlan& plan, std::size_t brick, const BrickStates& states);

}  // namespace covol
