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

/// Parameters that change the result of evolve(). Symbols and equation numbers are those of the paper; lengths, such as
/// the voxel size h, are in world units; the flow's speed is 1 world unit per unit of time.
struct EvolveOptions {
    double theta = 1.0;           ///< θ in [0,1]: weight of the pull towards the points, Eq. (3).
    double rho = 1.0;             ///< ρ in [0,1]: weight of the pull towards image edges, Eq. (3).
    std::optional<double> delta;  ///< δ >= 0: weight of curvature, Eq. (1), world units; automatic: 1 voxel
    std::optional<double> tau;    ///< τ > 0: time step; automatic: h (one voxel at unit speed), and longer while the
                                  ///< surface moves slowly, if rho is 0 or image_yields is above 0
    double epsilon = 1e-2;        ///< ε > 0: regularises |∇u|, Eqs. (13)-(14); dimensionless.
    /// ε in |∇g|_ε, Eq. (20): change of g per voxel below which the attraction by edges fades out.
    double edge_epsilon = 0.02;
    /// r, world units: the points attract with full weight up to the distance r/2, and not at all beyond r; 0:
    /// unlimited. Automatic: unlimited; segment() chooses a value.
    std::optional<double> attraction_range;
    /// in [0,1]: fraction by which ρ is reduced at marks; the reduction decreases with the distance from them like the
    /// attraction of the points. Automatic: 0; segment() chooses a value.
    std::optional<double> image_yields;
    /// in [0,1]: factor of θ far from all trusted marks (EvolveFields::trusted). It increases to 1 towards these marks,
    /// with the same dependence on the distance as the attraction of the points.
    double guess_weight = 1.0;
    /// the narrow band moves with the surface; needed unless the start was tagged, because the bands of all other
    /// starts are only 6 voxels wide
    bool follow = false;
    int max_steps = 500;  ///< upper bound on time steps, >= 0
    /// the flow is steady if the zero crossings move by less than tolerance * τ per step on average. It is also steady
    /// if their net motion over 10 steps (3 with `follow`), which oscillations do not affect, is below that limit per
    /// step.
    double tolerance = 2e-3;
    /// Residual at which a step's linear solve ends, relative to that of the previous u; automatic: 1e-3 if `tau` is
    /// given, else 1e-2: then only the steady state matters, which the solver's error does not change.
    std::optional<double> solver_tolerance;
    [[nodiscard]] double solved_to() const { return solver_tolerance.value_or(tau ? 1e-3 : 1e-2); }
    int max_sweeps = 200;  ///< maximum number of the linear solver's sweeps in one step
};

template <>
inline constexpr auto kOptions<EvolveOptions> = std::tuple{
    Option{"theta", &EvolveOptions::theta, kFraction, Group::Flow, "weight of the points, 0 to 1"},
    Option{"rho", &EvolveOptions::rho, kFraction, with_image(Group::Flow), "weight of the image, 0 to 1"},
    Option{"delta", &EvolveOptions::delta, kLength, Group::Flow, "weight of curvature",
           "0.25vx after tagging, for contours or a guess, 0.1vx after growth, else 1vx", "1vx"},
    Option{"tau", &EvolveOptions::tau, kPositiveLength, Group::Flow,
           "time step; the flow's speed is 1 world unit per unit of time", "1vx or more"},
    Option{"epsilon", &EvolveOptions::epsilon, kPositive, Group::Numerics, "regularises the norm of grad u"},
    Option{"attraction_range", &EvolveOptions::attraction_range, kLength, Group::Flow,
           "the points attract fully up to half of this distance, and not at all beyond it; 0: unlimited",
           "6vx; 0 after tagging without an image; 3 spacings after the start 'cloud'", "0"},
    Option{"edge_epsilon", &EvolveOptions::edge_epsilon, kPositive, with_image(Group::Numerics),
           "regularises the norm of grad g"},
    Option{"image_yields", &EvolveOptions::image_yields, kFraction, with_image(Group::Flow),
           "fraction of rho that fades out close to points, with the taper of the attraction range, 0 to 1",
           "1 after tagging and for contours, else 0", "0"},
    Option{"guess_weight", &EvolveOptions::guess_weight, kFraction, with_image(Group::Flow),
           "fraction of theta that remains between marked slices, far from every mark, 0 to 1"},
    Option{"follow", &EvolveOptions::follow, single_step(Group::Flow), "let the band follow the surface"},
    Option{"max_steps", &EvolveOptions::max_steps, kNotNegative, Group::Flow, "maximum number of time steps"},
    Option{"tolerance", &EvolveOptions::tolerance, kNotNegative, Group::Flow,
           "the flow is steady below this mean change, in voxels per step of 1vx"},
    Option{"solver_tolerance", &EvolveOptions::solver_tolerance, kBetween0And1, Group::Numerics,
           "relative residual at which the linear solver of a step stops", "0.001 with `tau`, else 0.01"},
    Option{"max_sweeps", &EvolveOptions::max_sweeps, at_least(1)}};

/// Why evolve() returned. In every case u is the result of the last complete step.
enum class StopReason { NotRun, Steady, MaxSteps, Cancelled, Vanished };
[[nodiscard]] COVOL_API const char* to_string(StopReason reason);

/// The instruction set for which the innermost loops of evolve() were compiled, as chosen for this processor:
/// "baseline", "avx2" or "avx512". Results of different sets differ by less than 1e-4 voxels.
[[nodiscard]] COVOL_API const char* instruction_set();

struct EvolveReport {
    StopReason stop_reason = StopReason::NotRun;
    int steps = 0;
    double last_change = 0;      ///< mean displacement of the zero crossings in the last step, voxels
    std::vector<float> changes;  ///< that displacement for each step
    double sweeps_per_step = 0;
    std::int64_t leaf_visits = 0;        ///< number of visits of a leaf, over all steps and sweeps
    std::int64_t leaf_visits_saved = 0;  ///< visits skipped: the leaf was inactive or had converged
    std::int64_t active_voxels = 0;      ///< after the last step
    std::int64_t leaf_count = 0;
    double seconds_assembly = 0;
    double seconds_sweeps = 0;
};

/// The fields that move the surface; a field may be null if its weight is 0.
struct EvolveFields {
    /// distance d to the points, world units; points have no effect in inactive voxels
    const FloatGrid* distance = nullptr;
    const FloatGrid* edge = nullptr;  ///< g in (0,1]; the image has no effect in inactive voxels
    /// Distance to the trusted points, world units: the marks, without points that were interpolated between them.
    /// EvolveOptions::image_yields and guess_weight depend on this distance. Inactive voxels count as far from all
    /// trusted points; null: all points are trusted.
    const FloatGrid* trusted = nullptr;
    /// An upper bound of u, world units: after each step u <= obstacle, so that {obstacle < 0} stays inside. Outside of
    /// its leaves its background is the bound; null: no bound.
    const FloatGrid* obstacle = nullptr;
    /// A lower bound in the same form: u >= floor. If both bounds are equal in a voxel, u is fixed there.
    const FloatGrid* floor = nullptr;
    /// With `follow`: called with u when its band has reached voxels in which a field is not known yet, so that the
    /// caller can extend the field (and may replace the pointers above through `fields`).
    std::function<void(const FloatGrid& u, EvolveFields& fields)> extend;
    /// Called when the flow resumes from a saved state (RunContext::checkpoints), with the edge grid of that state,
    /// which `extend` had made.
    std::function<void(const FloatGridPtr& edge, EvolveFields& fields)> take_edge;
};

/// Moves the level set u to the boundary of the segment by the semi-implicit co-volume scheme with upwinding, Eqs.
/// (13)-(17) and (19)-(22), on u's active voxels.
///
/// @param u  in/out, world units; active voxels are the band; u < 0 inside; inactive voxels keep their values.
/// @pre   all grids share one transform: uniform voxel size and a translation (domain_of()).
/// @post  without `follow`, u keeps its active voxels, and its values stay between the minimum and the maximum of the
///     given ones; with `follow`, u gets a new tree (accessors become invalid). Values do not depend on the number of
///     threads.
/// With RunContext::checkpoints the state is saved at intervals, at the end and on cancellation, and the flow resumes
/// from a saved state; the final result is bit-identical.
/// @throws Error  InvalidOptions, InvalidInput (no active voxel; transforms differ; a value that is not finite; a
///     needed field is null), Numerical (u keeps the values of the step before).
COVOL_API EvolveReport evolve(FloatGrid& u, const EvolveFields& fields, const EvolveOptions& options = {},
                              const RunContext& run = {});

}  // namespace covol
