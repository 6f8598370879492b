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

// A computation in parts: the surface is computed brick by brick, on several machines or one brick after the other, and
// the results are joined.
//
// A coarse solve of the whole domain gives every brick its start. A brick is solved together with some layers of voxels
// of its neighbours; the outermost of these layers are fixed to the neighbours' last results (the alternating method of
// Schwarz, 1870; for all bricks at once: Lions, On the Schwarz alternating method, 1988). Sweeps over the bricks are
// repeated until the surfaces of neighbours agree near the faces between them. All bricks lie on one lattice and each
// of its leaves belongs to at most one brick, so that the joined level set is a union of leaves; near the border of two
// bricks its values are the weighted mean of both results.
namespace covol {

struct BrickOptions {
    /// > 0: maximum number of active voxels in a brick, without the layers of its neighbours
    std::int64_t max_voxels = 8'000'000;
    /// width of the layers of neighbouring voxels with which a brick is solved, in voxels: a multiple of 8, 8 to 2^23
    int overlap = 16;
    double tolerance = 0.05;  ///< the surfaces of neighbours agree if they differ by less than this; voxels, > 0
    int max_sweeps = 4;       ///< maximum number of sweeps over all bricks, >= 1
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
    VoxelBox core;  ///< voxels of the lattice that belong to the brick: whole leaves, limited by the domain
    std::int64_t active_voxels = 0;  ///< estimated from the coarse solve
    /// indices of the other bricks whose cores are within BrickOptions::overlap voxels of the core of this brick
    std::vector<std::size_t> neighbours;
};

/// The data that all bricks have in common.
struct BrickPlan {
    BrickOptions options;
    Domain domain;        ///< of all bricks together
    EdgeOptions edge;     ///< parameters of the edge detector g, the same for all bricks
    FloatGridPtr coarse;  ///< the result of the coarse solve, from which the bricks start; a level set
    std::vector<Brick> bricks;
    /// false for clouds: each brick is solved only once, because its surface does not depend on the states of its
    /// neighbours
    bool has_sweeps = true;
    [[nodiscard]] COVOL_API std::int64_t active_voxels() const;
};

struct SolvedBrick {
    FloatGridPtr state;  ///< the new level set of the brick; without leaves if no surface passes through the brick
    StopReason stop_reason = StopReason::NotRun;
    int steps = 0;
    std::int64_t active_voxels = 0;
    double seconds = 0;
};

/// Returns the last state of a brick, which is the level set on the leaves of its core and on one layer of leaves
/// around it; null if the brick has not been solved yet.
using BrickStates = std::function<FloatGridPtr(std::size_t brick)>;

/// A segmentation or reconstruction that is computed in bricks. It starts from tagged points, from a cloud, or from a
/// given shape (sphere, box, mesh, mask or level set) that evolves. Guesses and contours are not supported, because
/// their surface depends on all marks at once.
class BrickJob {
public:
    /// Makes the automatic choices that `options` leaves open; for a cloud this includes its orientation.
    /// @throws Error as segment() and reconstruct(); Unsupported if the job cannot be done in bricks
    COVOL_API BrickJob(const Image& image, const std::vector<Vec3>& points, const SegmentOptions& options,
                       const RunContext& run);
    COVOL_API BrickJob(const std::vector<Vec3>& points, const SegmentOptions& options, const RunContext& run);
    COVOL_API ~BrickJob();
    BrickJob(const BrickJob&) = delete;
    BrickJob& operator=(const BrickJob&) = delete;

    /// Solves the whole domain on a coarse lattice and splits it into bricks. @throws Error as segment() and
    /// reconstruct(), InvalidOptions.
    [[nodiscard]] COVOL_API BrickPlan plan(const BrickOptions& options) const;
    /// Solves one brick, starting from its own and its neighbours' last states, or from the coarse solve if `states`
    /// has no state of the brick.
    /// @throws Error InvalidInput (a plan of a job with another voxel size)
    [[nodiscard]] COVOL_API SolvedBrick solve(const BrickPlan& plan, std::size_t brick,
                                              const BrickStates& states) const;
    /// Joins the states of all bricks and finishes the surface as segment() does.
    /// @param without_mesh  true has the same effect as SegmentOptions::without_mesh
    /// @throws Error InvalidInput (no surface remains)
    [[nodiscard]] COVOL_API SegmentResult join(const BrickPlan& plan, const BrickStates& states,
                                               bool without_mesh = false) const;

private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

/// The maximum distance, in voxels, between the surfaces in the states of a brick and of its neighbours, in the three
/// layers of voxels on each side of the faces between their cores; 0 if no surface lies there. kHalfWidthVoxels if a
/// state is missing, or if the surface of one state lies outside the narrow band of the other.
[[nodiscard]] COVOL_API double measure_seams(const BrickPlan& plan, std::size_t brick, const BrickStates& states);

}  // namespace covol
