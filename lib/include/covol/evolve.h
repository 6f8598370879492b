#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// What changes the result of evolve(). Symbols and equation numbers are the paper's; lengths are in world
/// units, the unit of the voxel size h; the flow's speed is 1 world unit per unit of time.
struct EvolveOptions {
    double theta = 1.0;           ///< θ in [0,1]: weight of the pull towards the points, Eq. (3).
    double rho = 1.0;             ///< ρ in [0,1]: weight of the pull towards image edges, Eq. (3).
    std::optional<double> delta;  ///< δ >= 0: weight of curvature, Eq. (1), world units; automatic: 1 voxel
    std::optional<double> tau;    ///< τ > 0: time step; automatic: h (one voxel at unit speed), and more while the
                                  ///< surface moves slowly, unless an image alone decides
    double epsilon = 1e-2;        ///< ε > 0: regularises |∇u|, Eqs. (13)-(14); dimensionless.
    double edge_epsilon = 0.02;   ///< ε in |∇g|_ε, Eq. (20): a slope of g per voxel; below it the pull fades.
    /// r, world units: the points pull fully up to r/2, not at all beyond r; 0: unlimited; automatic: unlimited, but
    /// segment() chooses.
    std::optional<double> attraction_range;
    /// in [0,1]: share of ρ that fades close to marks, on the attraction range's taper; automatic: 0, but segment()
    /// chooses.
    std::optional<double> image_yields;
    /// in [0,1]: θ is this much of itself where no trusted mark is near, on the same taper.
    double guess_weight = 1.0;
    bool follow = false;      ///< the band follows the surface (starts other than tagging).
    int max_steps = 500;      ///< upper bound on time steps, >= 0
    double tolerance = 2e-3;  ///< steady when the zero crossings move less than tolerance * τ a step on the average,
                              ///< or when over 10 steps fewer voxels than that changed sign
    /// A step's solve ends at this residual, relative to that of u before; automatic: 1e-3 where `tau` is given, else
    /// 1e-2: on the way to rest it is the end that counts, which the solver's error does not move.
    std::optional<double> solver_tolerance;
    [[nodiscard]] double solved_to() const { return solver_tolerance.value_or(tau ? 1e-3 : 1e-2); }
    int max_sweeps = 200;  ///< upper bound on a step's sweeps
};

template <>
inline constexpr auto kOptions<EvolveOptions> =
    std::tuple{Option{"theta", &EvolveOptions::theta, kFraction, Group::Flow, "weight of the points, 0 to 1"},
               Option{"rho", &EvolveOptions::rho, kFraction, with_image(Group::Flow), "weight of the image, 0 to 1"},
               Option{"delta", &EvolveOptions::delta, kLength, Group::Flow, "weight of curvature",
                      "0.5vx after tagging, else 1vx", "1vx"},
               Option{"tau", &EvolveOptions::tau, kPositiveLength, Group::Flow,
                      "time step; the flow's speed is 1 world unit per unit of time", "1vx and more"},
               Option{"epsilon", &EvolveOptions::epsilon, kPositive, Group::Numerics, "regularises the norm of grad u"},
               Option{"attraction_range", &EvolveOptions::attraction_range, kLength, Group::Flow,
                      "points pull fully up to half of it, not at all beyond; 0: unlimited",
                      "after tagging 8vx, and 0 where the image has no weight; else 5vx", "0"},
               Option{"edge_epsilon", &EvolveOptions::edge_epsilon, kPositive, with_image(Group::Numerics),
                      "regularises the norm of grad g"},
               Option{"image_yields", &EvolveOptions::image_yields, kFraction, with_image(Group::Flow),
                      "fraction of rho that fades close to points, on the attraction range's taper, 0 to 1",
                      "1 after tagging, else 0", "0"},
               Option{"guess_weight", &EvolveOptions::guess_weight, kFraction, with_image(Group::Flow),
                      "fraction of theta that is left to what lies between marked slices, far from every mark, 0 to 1"},
               Option{"follow", &EvolveOptions::follow, single_step(Group::Flow), "the band follows the surface"},
               Option{"max_steps", &EvolveOptions::max_steps, kNotNegative, Group::Flow, "upper bound on time steps"},
               Option{"tolerance", &EvolveOptions::tolerance, kNotNegative, Group::Flow,
                      "steady below this mean change, in voxels a step of 1vx"},
               Option{"solver_tolerance", &EvolveOptions::solver_tolerance, kBetween0And1, Group::Numerics,
                      "a step's solve ends at this relative residual", "0.001 with `tau`, else 0.01"},
               Option{"max_sweeps", &EvolveOptions::max_sweeps, at_least(1)}};

/// Why evolve() returned. In every case u holds the last whole step.
enum class StopReason { NotRun, Steady, MaxSteps, Cancelled, Vanished };
[[nodiscard]] COVOL_API const char* to_string(StopReason reason);

/// What the kernels run with, as chosen for this processor: "baseline", "avx2" or "avx512". Between sets results differ
/// by less than 1e-4 voxels.
[[nodiscard]] COVOL_API const char* instruction_set();

struct EvolveReport {
    StopReason stop_reason = StopReason::NotRun;
    int steps = 0;
    double last_change = 0;      ///< as in EvolveOptions::tolerance, voxels
    std::vector<float> changes;  ///< the same of each step
    double sweeps_per_step = 0;
    std::int64_t leaf_visits = 0;        ///< leaves swept, over all steps and sweeps
    std::int64_t leaf_visits_saved = 0;  ///< visits to leaves where nothing happened, that were left out
    std::int64_t active_voxels = 0;      ///< at the end
    std::int64_t leaf_count = 0;
    double seconds_assembly = 0;
    double seconds_sweeps = 0;
};

/// The fields that move the surface. Null where the weight is 0.
struct EvolveFields {
    const FloatGrid* distance = nullptr;  ///< d to the points, world units; where inactive the points do not pull
    const FloatGrid* edge = nullptr;      ///< g in (0,1]; where inactive the image does not pull
    const FloatGrid* trusted = nullptr;   ///< d to those points that are marks and no guess; the image yields to these
                                          ///< alone; where inactive none is near; null: all are trusted
    /// A level set that the surface may not sink below: after each step u <= obstacle, world units, so that
    /// {obstacle < 0} stays inside. Beyond its leaves its background holds; null: none.
    const FloatGrid* obstacle = nullptr;
    /// The same from below: u >= floor. Where both are the same the surface is held.
    const FloatGrid* floor = nullptr;
    /// With `follow`: called with u when its band reached voxels where a field is not known yet, so that the caller
    /// can extend it (and may replace the pointers above through `fields`).
    std::function<void(const FloatGrid& u, EvolveFields& fields)> extend;
    /// Called with the edges that `extend` had made, where the flow goes on from a state (RunContext::checkpoints).
    std::function<void(const FloatGridPtr& edge, EvolveFields& fields)> take_edge;
};

/// Moves the level set u to the boundary of the segment: the semi-implicit co-volume scheme with upwinding,
/// Eqs. (14)-(22), on u's active voxels.
///
/// @param u  in/out, world units; active voxels are the band; u < 0 inside; inactive voxels keep their values.
/// @pre   all grids share one transform: uniform voxel size and a translation (domain_of()).
/// @post  without `follow`, u keeps its topology; with it u gets a new tree (accessors become invalid); values do not
/// depend on the number of threads;
///        without `follow`, min u0 <= u <= max u0.
/// With RunContext::checkpoints its state is kept at intervals, at its end and where it is cancelled, and one that was
/// kept before is gone on from; the end has the same bits.
/// @throws Error  InvalidOptions, InvalidInput (no active voxel; transforms differ; a value that is not finite; a
///                needed field is null), Numerical (u is left at the step before).
COVOL_API EvolveReport evolve(FloatGrid& u, const EvolveFields& fields, const EvolveOptions& options = {},
                              const RunContext& run = {});

}  // namespace covol
