// The semi-implicit co-volume scheme of Kósa, Mikula et al., "3D image segmentation supported by a point cloud",
// Eqs. (13)-(17), (19)-(22), on the active voxels of a narrow band:
//   u_p + Σ_q a_pq (u_q - u_p) = u_p^{n-1},   a_pq = (τ/h³) min(v_pq, 0) - (τδ/h²) M_p W_pq <= 0.
// docs/method.md, "The model", defines v_pq, M_p and W_pq. This is the loop over time; a step is in band_solver.cpp,
// the arithmetic on a leaf in scheme/scheme_kernels.cpp.
#include "covol/evolve.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "base/heuristics.h"
#include "base/number.h"
#include "covol/domain.h"
#include "covol/error.h"
#include "evolve/band_solver.h"
#include "evolve/finite.h"
#include "evolve/flow_states.h"
#include "evolve/heuristics.h"
#include "evolve/motion.h"
#include "grid/active_tiles.h"
#include "redistance/tracking.h"
#include "scheme/scheme.h"

namespace covol {
namespace {

double tracking_clamp(const EvolveOptions& options) {
    return options.rho > 0 ? kHalfWidthVoxels : detail::kTrackingWidth;
}

bool has_active(const FloatGrid& u) {
    for (auto leaf = u.tree().cbeginLeaf(); leaf; ++leaf)
        if (!leaf->isEmpty()) return true;
    return false;
}

// Motion in a step, relative to the motion that counts as steady, below which a leaf becomes inactive, unless one of
// the 26 leaves around it moves by more.
constexpr double kInactiveFraction = 0.2;
// Maximum automatic time step, in units of h: limits the condition number of the linear systems while the front hardly
// moves.
constexpr double kLargestTau = 10;

// Limits of the step of check_step(): tau times the strongest weight. The coefficients of a row are stored as
// fractions, accurate to half of 1/65535. With the smallest step, the motion is wrong by at most 1.5 %; with the
// largest step, the fraction of the voxel itself, 1/(1 + 6 * step), is still above the smallest fraction that can be
// stored.
constexpr double kSmallestStep = 5e-4, kLargestStep = 1e4;

// Steps between two examinations of a tracked band. A step moves the front by less than a voxel, so that it stays
// within the band for as many steps as the band's half width has voxels.
constexpr int kCycle = int(kHalfWidthVoxels);

class Evolver {
public:
    Evolver(FloatGrid& u, const EvolveFields& fields, const EvolveOptions& options, const RunContext& run)
        : u_(u), fields_(fields), options_(options), run_(run), domain_(domain_of(u)), states_(run.checkpoints.get()) {
        tau_ = options.tau ? *options.tau / domain_.voxel_size : 1.0;
        if (options.theta > 0) check_field(fields.distance, "distance", "theta");
        if (options.rho > 0) check_field(fields.edge, "edge", "rho");
        if (fields.obstacle != nullptr) check_transform(*fields.obstacle, "obstacle");
        if (fields.floor != nullptr) check_transform(*fields.floor, "floor");
        check_step();
        if (options.follow) {
            // Checked before u changes. A fixed band is checked by BandSolver.
            detail::expect_finite(u, "u");
            if (!has_active(u)) throw Error(Errc::InvalidInput, "evolve: expected active voxels in u, got none");
            for (const auto& [field, name] : {std::pair(fields.distance, "distance"), std::pair(fields.edge, "edge"),
                                              std::pair(fields.trusted, "trusted"),
                                              std::pair(fields.obstacle, "obstacle"), std::pair(fields.floor, "floor")})
                if (field != nullptr) detail::expect_finite(*field, name);
        }
        if (states_.any()) {
            resume();
            return;
        }
        if (options.follow && is_held())
            detail::track_surface(u_, domain_, tracking_clamp(options_));
        else if (options.follow)
            detail::track_free_surface(u_, domain_, run_);
        make_solver();
    }

    EvolveReport run() {
        if (is_finished_) return report_;
        report_.stop_reason = StopReason::MaxSteps;
        while (report_.steps < options_.max_steps) {
            if (states_.is_due() || (states_.are_enabled() && run_.cancelled())) save_state();
            if (run_.cancelled()) {
                report_.stop_reason = StopReason::Cancelled;
                break;
            }
            const detail::Motion motion = solver_->step(tau_, counts_);
            if (!motion.finite) {
                solver_->restore_previous();
                solver_->store(u_);
                throw Error(
                    Errc::Numerical,
                    "evolve: step " + std::to_string(report_.steps + 1) +
                        ": a value became infinite or NaN; u was restored to its state after the previous step");
            }
            ++report_.steps;
            report_.last_change = motion.mean;
            report_.changes.push_back(float(motion.mean));
            run_.report("evolve", progress());
            if (!motion.crosses) {
                report_.stop_reason = StopReason::Vanished;
                break;
            }
            const double settled = options_.follow ? track(motion.mean) : keep_band(motion.mean);
            if (!solver_) {
                report_.stop_reason = StopReason::Vanished;
                save_final_state();
                return report_;
            }
            if (settled < options_.tolerance * tau_) {
                report_.stop_reason = StopReason::Steady;
                break;
            }
            if (!options_.tau && (options_.rho == 0 || options_.image_yields.value_or(0) > 0)) adapt_tau(motion.mean);
        }
        solver_->store(u_);
        report_.sweeps_per_step = report_.steps > 0 ? double(counts_.passes) / report_.steps : 0.0;
        report_.leaf_visits = counts_.visits;
        report_.leaf_visits_saved = counts_.visits_saved;
        report_.seconds_assembly = counts_.seconds_assembly;
        report_.seconds_sweeps = counts_.seconds_sweeps;
        report_.active_voxels = solver_->active_count();
        report_.leaf_count = static_cast<std::int64_t>(solver_->band().size());
        save_final_state();
        return report_;
    }

private:
    void check_field(const FloatGrid* field, const char* name, const char* weight) const {
        if (field == nullptr)
            throw Error(Errc::InvalidInput,
                        std::string("evolve: ") + weight + " > 0 needs the " + name + " grid, got none");
        check_transform(*field, name);
    }

    void check_transform(const FloatGrid& field, const char* name) const {
        const Domain other = domain_of(field);
        const double h = domain_.voxel_size;
        double apart = std::abs(other.voxel_size - h);
        for (int a = 0; a < 3; ++a) apart = std::max(apart, std::abs(other.origin[a] - domain_.origin[a]));
        if (apart > 1e-6 * h)
            throw Error(Errc::InvalidInput, std::string("evolve: expected one transform for all grids, but that of ") +
                                                name + " differs from u's");
    }

    void check_step() const {
        const double delta = options_.delta ? *options_.delta / domain_.voxel_size : 1.0;
        const double strongest = std::max({options_.theta, options_.rho, delta});
        const double step = tau_ * strongest;
        if (strongest == 0 || (step >= kSmallestStep && step <= kLargestStep)) return;
        throw Error(Errc::InvalidOptions,
                    std::string("evolve: ") + (options_.tau ? "`tau`" : "`delta`") + ": expected a step of " +
                        detail::number(kSmallestStep) + " to " + detail::number(kLargestStep) + ", got " +
                        detail::number(step) +
                        "; it is tau times the largest of theta, rho and delta, with lengths in voxels, and outside of "
                        "this range 16 bits cannot represent the coefficients of the scheme",
                    options_.tau ? "tau" : "delta");
    }

    // A state is saved between two steps. It consists of the level set from which the band was made, and of everything
    // that steps have changed since the band was made. This function writes or reads the second part.
    void exchange(detail::StateFile& file) {
        file.value(is_finished_);
        file.value(tau_);
        file.value(report_.stop_reason);
        file.value(report_.steps);
        file.value(report_.last_change);
        file.list(report_.changes);
        file.value(report_.sweeps_per_step);
        file.value(report_.leaf_visits);
        file.value(report_.leaf_visits_saved);
        file.value(report_.active_voxels);
        file.value(report_.leaf_count);
        file.value(report_.seconds_assembly);
        file.value(report_.seconds_sweeps);
        file.value(counts_);
        if (is_finished_) return;
        if (file.reads()) make_solver();
        solver_->exchange(file);
        net_motion_.exchange(file);
        front_displacement_.exchange(file);
        marks_.exchange(file);
    }

    void resume() {
        const detail::FlowStates::Grids grids = states_.read_grids();
        check_transform(*grids.u, "checkpoint");
        u_.setTree(grids.u->treePtr());
        if (grids.edge && fields_.take_edge) fields_.take_edge(grids.edge, fields_);
        states_.read([&](detail::StateFile& file) { exchange(file); });
        run_.info("evolve: " + std::string(is_finished_ ? "already finished after " : "continues after ") +
                  std::to_string(report_.steps) + " steps");
    }

    void save_state() {
        const FloatGrid* u = is_band_new_ ? &u_ : nullptr;
        states_.write(u, options_.follow ? fields_.edge : nullptr, [&](detail::StateFile& file) { exchange(file); });
        is_band_new_ = false;
    }

    void save_final_state() {
        if (!states_.are_enabled() || report_.stop_reason == StopReason::Cancelled) return;
        is_finished_ = is_band_new_ = true;
        save_state();
    }

    void make_solver() {
        is_band_new_ = true;
        solver_ = std::make_unique<detail::BandSolver>(u_, fields_, options_, domain_);
        if (!options_.follow) return;
        front_displacement_.set_references(solver_->values());
        marks_.resize(solver_->band().size());
    }

    [[nodiscard]] double inactive_below() const { return kInactiveFraction * options_.tolerance * tau_; }

    // For a fixed band: updates which leaves are active. @return remaining motion of the surface, voxels per step: the
    // smaller one of `motion` and its net motion
    double keep_band(double motion) {
        solver_->update_active_leaves(solver_->largest_changes(), inactive_below());
        return std::min(motion, net_motion_.per_step(solver_->values()));
    }

    // Whether points or edges of the image hold the surface. Then only its steady state matters, not the path to it.
    [[nodiscard]] bool is_held() const { return options_.theta > 0 || options_.rho > 0; }

    // Narrow-band tracking. Advection turns the profile of u into a step, which creeps over the lattice. Therefore u is
    // examined every few steps, and redistanced if |grad u| on the front shows that it is no longer a distance, or if
    // the band has to move. Each redistancing moves the front slightly, so it is done only if necessary. The front's
    // displacement is measured just before that, at the same phase of each cycle.
    double track(double motion) {
        if (report_.steps % kCycle != 0) return motion;
        std::vector<float> largest;
        const Front front = measure_front(largest);
        const std::vector<std::size_t> left = front_displacement_.due_leaves(solver_->values());
        if (!left.empty() || (!is_held() && !front.is_distance))
            rebuild_band(left, largest);
        else if (!front.is_distance)
            solver_->redistance(tracking_clamp(options_));
        // This is done after the redistancing, because a leaf that becomes inactive keeps its present values: they are
        // then from the same phase of the cycle as those of active leaves at the end of the evolution.
        if (solver_) solver_->update_active_leaves(largest, kCycle * inactive_below());
        return std::min(motion, front.moved / kCycle);
    }

    struct Front {
        double moved;      // mean displacement of the front since the last call, voxels
        bool is_distance;  // |grad u| on the front is neither too small nor too large in any leaf
    };
    // @param largest  out: of each leaf, the displacement of the crossing that moved most since the last call, voxels
    Front measure_front(std::vector<float>& largest) {
        const detail::BandValues u = solver_->values();
        const std::size_t leaves = u.size();
        std::vector<float> mean(leaves, 0.0F), slope(leaves, 1.0F);
        largest.assign(leaves, 0.0F);
        tbb::parallel_for(std::size_t(0), leaves, [&](std::size_t leaf) {
            if (!solver_->is_leaf_active(leaf)) return;
            const detail::CrossingMarks::Displacement moved = marks_.renew(leaf, u.leaf(leaf), u.in_domain(leaf));
            largest[leaf] = static_cast<float>(moved.largest);
            mean[leaf] = static_cast<float>(moved.mean);
            slope[leaf] = static_cast<float>(moved.slope);
        });
        const auto [flattest, steepest] = std::minmax_element(slope.begin(), slope.end());
        double sum = 0.0, crossings = 0.0;
        for (std::size_t leaf = 0; leaf < leaves; ++leaf) {
            const auto count = static_cast<double>(marks_.count(leaf));
            if (count > 0) sum += mean[leaf] * count;
            crossings += count;
        }
        return {crossings > 0 ? sum / crossings : 0.0,
                *flattest >= detail::kFlattest && *steepest <= detail::kSteepest};
    }

    // Rebuilds the band around the moved surface; solver_ is null afterwards if no surface remains.
    // @param left     leaves that the front has left, or is about to
    // @param largest  displacements from measure_front(); in: for each previous leaf; out: for each new leaf
    void rebuild_band(const std::vector<std::size_t>& left, std::vector<float>& largest) {
        std::vector<detail::Coord> stale;
        for (const std::size_t leaf : left) stale.push_back(solver_->band().origin(leaf));
        solver_->store(u_);
        const detail::BandSolver::LeafStates states = solver_->take_leaf_states();
        solver_.reset();  // its memory is freed before a new solver is made
        std::vector<detail::Coord> changed;
        if (is_held())
            changed = detail::track_surface_near(stale, u_, domain_, tracking_clamp(options_));
        else
            detail::track_free_surface(u_, domain_, run_);
        if (!has_active(u_)) return;
        if (fields_.extend) fields_.extend(u_, fields_);
        solver_ = std::make_unique<detail::BandSolver>(u_, fields_, options_, domain_);
        is_band_new_ = true;
        if (is_held()) solver_->keep_inactive(states, changed);
        const detail::LeafBand& band = solver_->band();
        std::vector<std::int32_t> place(band.size()), same(band.size());
        for (std::size_t leaf = 0; leaf < band.size(); ++leaf) {
            const std::int32_t at = states.band.find(band.origin(leaf));
            place[leaf] = at == states.band.none() ? -1 : at;
            const bool is_new = !is_held() || std::binary_search(changed.begin(), changed.end(), band.origin(leaf));
            same[leaf] = is_new ? -1 : place[leaf];
        }
        std::vector<float> moved(band.size(), std::numeric_limits<float>::infinity());
        for (std::size_t leaf = 0; leaf < band.size(); ++leaf)
            if (place[leaf] >= 0) moved[leaf] = largest[place[leaf]];
        largest = std::move(moved);
        front_displacement_.remake(same, solver_->values());
        marks_.remake(place);
        if (is_held()) solver_->redistance(tracking_clamp(options_));
    }

    // Adapts the time step so that the front moves by about kMotion.left_by in a cycle. The motion may differ from this
    // by two changes of the time step in each direction, so that the time step does not alternate.
    void adapt_tau(double motion) {
        const double aim = kMotion.left_by / kCycle, margin = kCommon.growth * kCommon.growth;
        if (motion < aim / margin) tau_ = std::min(tau_ * kCommon.growth, kLargestTau);
        if (motion > aim * margin) tau_ = std::max(tau_ / kCommon.growth, 1.0);
    }

    // The fraction of the evolution that is done: the larger one of two estimates, from the number of steps and from
    // the decrease of the change.
    [[nodiscard]] double progress() const {
        const double by_steps = double(report_.steps) / options_.max_steps;
        if (!(report_.last_change > 0) || !(options_.tolerance > 0)) return by_steps;
        const double by_change = std::log(report_.last_change / tau_) / std::log(options_.tolerance);
        return std::clamp(std::max(by_steps, by_change), 0.0, 1.0);
    }

    FloatGrid& u_;
    EvolveFields fields_;
    const EvolveOptions& options_;
    const RunContext& run_;
    const Domain domain_;
    detail::FlowStates states_;
    bool is_finished_ = false, is_band_new_ = true;  // is_band_new_: not saved yet
    double tau_ = 1.0;                               // time step / h
    std::unique_ptr<detail::BandSolver> solver_;
    detail::BandSolver::Counts counts_;
    detail::NetMotion net_motion_;
    detail::FrontDisplacement front_displacement_;
    detail::CrossingMarks marks_;
    EvolveReport report_;
};

}  // namespace

const char* instruction_set() { return detail::kernels().name; }

const char* to_string(StopReason reason) {
    switch (reason) {
        case StopReason::Steady: return "steady";
        case StopReason::MaxSteps: return "max_steps";
        case StopReason::Cancelled: return "cancelled";
        case StopReason::Vanished: return "vanished";
        case StopReason::NotRun: break;
    }
    return "not_run";
}

EvolveReport evolve(FloatGrid& u, const EvolveFields& fields, const EvolveOptions& options, const RunContext& run) {
    require_valid(options, "evolve");
    EvolveReport report;
    with_threads(run, [&] {
        detail::require_memory_of_tiles(u, "evolve", run);
        u.tree().voxelizeActiveTiles();
        report = Evolver(u, fields, options, run).run();
    });
    return report;
}

}  // namespace covol
