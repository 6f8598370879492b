#include "evolve/band_solver.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>

#include "covol/error.h"
#include "evolve/change_kernel.h"
#include "evolve/finite.h"
#include "evolve/state_file.h"
#include "redistance/local_distance.h"

namespace covol::detail {
namespace {

using LeafNode = FloatGrid::TreeType::LeafNodeType;
using Clock = std::chrono::steady_clock;

constexpr double kRounding = 5e-7;  // voxels; a residual below this results from the rounding of single precision

// How the system is solved. None of these is decisive: they change the number of visits, while the solution is the same
// up to `solver_tolerance`.
constexpr int kInnerSweeps = 2;     // sweeps in each visit of a leaf; the second saves a third of the visits
constexpr double kMaxOmega = 1.9;   // maximum factor of over-relaxation
constexpr double kDiverged = 10.0;  // growth of the residual at which over-relaxation is abandoned
constexpr double kLocalGoal = 0.5;  // fraction of solve()'s goal; a leaf below it is skipped if those beside it are

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// The weight of the points' attraction at the distance d: 1 up to range/2, decreasing to 0 at range. Its integral from
// 0 is the potential, so that the points attract by -taper(d) ∇d = -∇potential(d).
struct Taper {
    double range;  // world units; 0: no limit
    [[nodiscard]] double ramp(double d) const { return std::clamp(2.0 * d / range - 1.0, 0.0, 1.0); }
    [[nodiscard]] double operator()(double d) const {
        if (range == 0.0) return 1.0;
        const double t = ramp(d);
        return 1.0 - t * t * (3.0 - 2.0 * t);
    }
    [[nodiscard]] double potential(double d) const {
        if (range == 0.0) return d;
        const double t = ramp(d);
        return std::min(d, 0.5 * range) + 0.5 * range * t * (1.0 - t * t * (1.0 - 0.5 * t));
    }
};

// Copies convert(value) of active voxels, and kUnknown for the others. Only the faces of the halo are needed.
template <typename Convert>
HaloField gather_field(const LeafBand& band, const FloatGrid& grid, Convert convert) {
    return gather(band, grid, false, [&](const LeafNode* leaf, float, float* block) {
        for (int n = 0; n < kLeafSize; ++n)
            block[n] =
                leaf != nullptr && leaf->isValueOn(n) ? static_cast<float>(convert(leaf->getValue(n))) : kUnknown;
    });
}

// The points' potential in voxels, multiplied by guess_weight far from all trusted marks. The potential is weighted,
// not its slope; near the points, where d is small, both are equivalent.
HaloField gather_potential(const LeafBand& band, const EvolveFields& fields, const Taper& taper, double guess_weight,
                           double h) {
    const FloatGrid* trusted = guess_weight < 1.0 ? fields.trusted : nullptr;
    if (trusted == nullptr)
        return gather_field(band, *fields.distance, [&](float d) { return taper.potential(d) / h; });
    return gather(band, *fields.distance, false, [&](const LeafNode* leaf, float, float* block) {
        const LeafNode* near = leaf != nullptr ? trusted->tree().probeConstLeaf(leaf->origin()) : nullptr;
        for (int n = 0; n < kLeafSize; ++n) {
            const double closeness = near != nullptr && near->isValueOn(n) ? taper(near->getValue(n)) : 0.0;
            const double weight = guess_weight + (1.0 - guess_weight) * closeness;
            block[n] = leaf != nullptr && leaf->isValueOn(n)
                           ? static_cast<float>(weight * taper.potential(leaf->getValue(n)) / h)
                           : kUnknown;
        }
    });
}

void check_finite(const LeafBand& band, const HaloField& field, const char* what) {
    const std::size_t none = band.size();
    const std::size_t first = tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, band.size(), 64), none,
        [&](const tbb::blocked_range<std::size_t>& range, std::size_t found) {
            for (std::size_t leaf = range.begin(); leaf != range.end() && found == none; ++leaf) {
                const float* values = field.values.leaf(leaf);
                if (all_finite(values)) continue;
                for (int n = 0; n < kLeafSize && found == none; ++n)
                    if (is_on(band.active(leaf), n) && !std::isfinite(values[n])) found = leaf;
            }
            return found;
        },
        [](std::size_t a, std::size_t b) { return std::min(a, b); });
    if (first == none) return;
    for (int n = 0; n < kLeafSize; ++n) {
        const float value = field.values.leaf(first)[n];
        if (!is_on(band.active(first), n) || std::isfinite(value)) continue;
        throw not_finite(what, value, band.origin(first).offsetBy(n >> 6, (n >> 3) & 7, n & 7));
    }
}

SchemeConstants constants_for(const EvolveOptions& options, double h, double tau) {
    const double delta = options.delta ? *options.delta / h : 1.0;
    SchemeConstants constants{};
    constants.tau = static_cast<float>(tau);
    constants.theta = static_cast<float>(options.theta);
    constants.rho = static_cast<float>(options.rho);
    constants.curvature = static_cast<float>(tau * delta);
    constants.epsilon2 = static_cast<float>(options.epsilon * options.epsilon);
    constants.edge_epsilon2 = static_cast<float>(options.edge_epsilon * options.edge_epsilon);
    return constants;
}

}  // namespace

BandSolver::BandSolver(const FloatGrid& u, const EvolveFields& fields, const EvolveOptions& options,
                       const Domain& domain)
    : options_(options), domain_(domain), band_(u), active_count_(band_.active_count()) {
    if (active_count_ == 0) throw Error(Errc::InvalidInput, "evolve: expected active voxels in u, got none");
    const auto scale = static_cast<float>(1.0 / domain_.voxel_size);
    field_ = gather(band_, u, true, [scale](const LeafNode* leaf, float tile, float* block) {
        for (int n = 0; n < kLeafSize; ++n) block[n] = scale * (leaf != nullptr ? leaf->getValue(n) : tile);
    });
    check_finite(band_, field_, "u");
    gather_fields(fields);
    previous_ = field_.values;
    motions_.resize(band_.size());
    const BandValues start = values();
    tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
        motions_[leaf] = without_comparison(start.leaf(leaf), start.in_domain(leaf));
    });
    rows_.resize(band_.size() * kRowBytes);
    active_counts_.resize(band_.size());
    for (std::size_t leaf = 0; leaf < band_.size(); ++leaf) active_counts_[leaf] = count_on(band_.active(leaf));
    leaf_active_.resize(band_.size());
    for (std::size_t leaf = 0; leaf < band_.size(); ++leaf) leaf_active_[leaf] = active_counts_[leaf] > 0;
    pending_motion_.assign(band_.size(), std::numeric_limits<float>::infinity());
    residuals_.assign(band_.size(), 0.0);
}

BandSolver::LeafStates BandSolver::take_leaf_states() {
    return {std::move(band_), std::move(leaf_active_), std::move(pending_motion_), std::move(motions_)};
}

void BandSolver::keep_inactive(const LeafStates& old, const std::vector<Coord>& changed) {
    tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
        const Coord& origin = band_.origin(leaf);
        const std::int32_t at = old.band.find(origin);
        if (at == old.band.none() || std::binary_search(changed.begin(), changed.end(), origin)) return;
        leaf_active_[leaf] = old.active[at];
        pending_motion_[leaf] = old.pending_motion[at];
        motions_[leaf] = old.motions[at];
    });
}

void BandSolver::exchange(StateFile& file) {
    const std::size_t leaves = band_.size();
    file.same(leaves);
    file.array(field_.values.leaf(0), leaves * kLeafSize);
    file.array(previous_.leaf(0), leaves * kLeafSize);
    file.value(has_previous_);
    file.array(leaf_active_.data(), leaves);
    file.array(pending_motion_.data(), leaves);
    file.array(motions_.data(), leaves);
}

void BandSolver::gather_fields(const EvolveFields& fields) {
    const Taper taper{options_.attraction_range.value_or(0)};
    if (options_.theta > 0) {
        const double h = domain_.voxel_size;
        phi_ = gather_potential(band_, fields, taper, options_.guess_weight, h);
        check_finite(band_, *phi_, "distance");
    }
    if (options_.rho > 0) {
        edge_ = gather_field(band_, *fields.edge, [](float g) { return g; });
        check_finite(band_, *edge_, "edge");
    }
    const auto gather_bound = [&](const FloatGrid* bound, const char* name) -> std::optional<HaloField> {
        if (bound == nullptr) return {};
        const auto scale = static_cast<float>(1.0 / domain_.voxel_size);
        HaloField values = gather(band_, *bound, false, [scale](const LeafNode* leaf, float tile, float* block) {
            for (int n = 0; n < kLeafSize; ++n) block[n] = scale * (leaf != nullptr ? leaf->getValue(n) : tile);
        });
        check_finite(band_, values, name);
        return values;
    };
    obstacle_ = gather_bound(fields.obstacle, "obstacle");
    floor_ = gather_bound(fields.floor, "floor");
    const FloatGrid* trusted = fields.trusted != nullptr ? fields.trusted : fields.distance;
    const double yields = options_.image_yields.value_or(0);
    if (options_.rho > 0 && yields > 0 && trusted != nullptr)
        image_weight_ = gather(band_, *trusted, false, [&](const LeafNode* leaf, float, float* block) {
            // A voxel without a value is far from all marks, so that the image has its full weight.
            for (int n = 0; n < kLeafSize; ++n)
                block[n] = leaf != nullptr && leaf->isValueOn(n)
                               ? static_cast<float>(1.0 - yields * taper(leaf->getValue(n)))
                               : 1.0F;
        });
}

Motion BandSolver::step(double tau, Counts& counts) {
    const SchemeConstants constants = constants_for(options_, domain_.voxel_size, tau);
    const auto start = Clock::now();
    const Rows rows = assemble(constants);
    counts.seconds_assembly += seconds_since(start);
    const auto solve_start = Clock::now();
    // `row` estimates Σ_q |a_pq|, on which the best over-relaxation depends. The largest of these sums belongs to some
    // voxel at the edge of the clamped region, where W is of order 1/ε. Optimising the relaxation for it costs sweeps
    // for all other voxels. In measurements with delta of 0.5 to 5 voxels, `regular_row` was best.
    const double regular_row = 8.0 * constants.curvature + tau * (options_.theta + options_.rho);
    const double row = std::min(rows.largest, regular_row);
    const double jacobi = row / (1.0 + row);
    solve(std::min(kMaxOmega, 2.0 / (1.0 + std::sqrt(1.0 - jacobi * jacobi))), rows.residual, counts);
    hold_to_bounds();
    counts.seconds_sweeps += seconds_since(solve_start);
    return measure();
}

void BandSolver::hold_to_bounds() {
    if (!obstacle_ && !floor_) return;
    tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
        if (!leaf_active_[leaf]) return;
        float* u = field_.values.leaf(leaf);
        const float* highest = obstacle_ ? obstacle_->values.leaf(leaf) : nullptr;
        const float* lowest = floor_ ? floor_->values.leaf(leaf) : nullptr;
        for (int n = 0; n < kLeafSize; ++n) {
            if (!is_on(band_.active(leaf), n)) continue;
            if (highest != nullptr) u[n] = std::min(u[n], highest[n]);
            if (lowest != nullptr) u[n] = std::max(u[n], lowest[n]);
        }
    });
}

// @param first  root mean square residual at u^{n-1}, voxels
void BandSolver::solve(double omega, double first, Counts& counts) {
    const double goal = std::max(options_.solved_to() * first, kRounding);
    double start = first;
    bool visit_all = true;
    for (int visit = 0; visit * kInnerSweeps < options_.max_sweeps; ++visit) {
        const double residual = sweep(static_cast<float>(omega), visit_all ? 0.0 : goal, counts);
        if (visit == 0) start = std::max(first, residual);  // the extrapolated initial value may be worse than u^{n-1}
        visit_all = omega > 1.0 && !(residual <= kDiverged * start);
        if (visit_all) {
            // Over-relaxation may fail where advection dominates; Gauss-Seidel converges on every M-matrix.
            omega = 1.0;
            restore_previous();
        } else if (!(residual > goal)) {
            break;
        }
    }
}

void BandSolver::update_active_leaves(const std::vector<float>& motion, double threshold) {
    std::vector<unsigned char> moved(band_.size() + 1, 0);
    for (std::size_t leaf = 0; leaf < band_.size(); ++leaf) {
        pending_motion_[leaf] += motion[leaf];
        if (pending_motion_[leaf] < threshold) continue;
        moved[leaf] = 1;
        pending_motion_[leaf] = 0.0F;
    }
    tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
        unsigned char is_active = moved[leaf];
        for (const std::int32_t next : band_.neighbours(leaf)) is_active |= moved[next];
        // An inactive leaf is not changed by further steps, and u^{n-1} = u^n in it.
        if (!is_active) std::copy_n(field_.values.leaf(leaf), kLeafSize, previous_.leaf(leaf));
        leaf_active_[leaf] = is_active && active_counts_[leaf] > 0;
    });
}

std::vector<float> BandSolver::largest_changes() const {
    std::vector<float> largest(band_.size());
    for (std::size_t leaf = 0; leaf < band_.size(); ++leaf) largest[leaf] = motions_[leaf].largest;
    return largest;
}

void BandSolver::redistance(double clamp) {
    static_assert(LocalDistance::kCuts * sizeof(float) <= kRowBytes);
    const auto limit = static_cast<float>(clamp);
    has_previous_ = false;
    LocalDistance local(band_, field_, leaf_active_, domain_, limit, limit,
                        {reinterpret_cast<float*>(rows_.data()), previous_.leaf(0)});
    local.compute();
    tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
        if (!leaf_active_[leaf]) return;
        float* u = field_.values.leaf(leaf);
        const float* d = local.settled(leaf);
        for (int n = 0; n < kLeafSize; ++n)
            if (is_on(band_.active(leaf), n)) u[n] = u[n] < 0.0F ? -std::min(d[n], limit) : std::min(d[n], limit);
    });
    hold_to_bounds();
}

// Computes the rows of all active leaves. The initial value of the solve extrapolates the last step, because
// consecutive steps are similar.
BandSolver::Rows BandSolver::assemble(const SchemeConstants& constants) {
    const SchemeKernels& kernel = kernels();
    std::vector<float> largest(band_.size(), 0.0F);
    tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
        residuals_[leaf] = 0.0;
        if (!leaf_active_[leaf]) return;
        alignas(64) float u[kPaddedSize], phi[kPaddedSize], edge[kPaddedSize];
        const LeafBounds bounds(domain_, band_.origin(leaf));
        load_padded(field_, leaf, u);
        if (phi_) load_star(*phi_, leaf, phi);
        if (edge_) load_star(*edge_, leaf, edge);
        if (bounds.cuts()) {
            mirror_outside(u, bounds.lo, bounds.hi);
            if (phi_) mirror_outside(phi, bounds.lo, bounds.hi);
            if (edge_) mirror_outside(edge, bounds.lo, bounds.hi);
        }
        const RowFacts facts = kernel.assemble(u, phi_ ? phi : nullptr, edge_ ? edge : nullptr,
                                               image_weight_ ? image_weight_->values.leaf(leaf) : nullptr, active(leaf),
                                               constants, rows(leaf));
        largest[leaf] = facts.largest;
        residuals_[leaf] = facts.residual;
        if (bounds.cuts()) close_faces(rows(leaf), bounds.lo, bounds.hi);
        const float* now = field_.values.leaf(leaf);
        float* guess = previous_.leaf(leaf);
        if (has_previous_)
            for (int n = 0; n < kLeafSize; ++n) guess[n] = 2.0F * now[n] - guess[n];
        else
            std::copy_n(now, kLeafSize, guess);
    });
    std::swap(field_.values, previous_);
    has_previous_ = true;
    return {*std::max_element(largest.begin(), largest.end()), root_mean_square()};
}

double BandSolver::root_mean_square() const {
    double sum = 0.0;
    for (const double r : residuals_) sum += r;
    return std::sqrt(sum / static_cast<double>(active_count_));
}

// Whether the residual of the leaf, or of a leaf across one of its faces, is above kLocalGoal * goal. With goal = 0,
// this is so for all leaves.
bool BandSolver::is_unconverged(std::size_t leaf, double goal) const {
    if (goal == 0.0) return true;
    const double per_voxel = kLocalGoal * goal * kLocalGoal * goal;
    const auto above = [&](std::size_t n) { return residuals_[n] > per_voxel * active_counts_[n]; };
    if (above(leaf)) return true;
    for (const int slot : kFaceSlots) {
        const std::int32_t next = band_.neighbours(leaf)[slot];
        if (next != band_.none() && above(next)) return true;
    }
    return false;
}

// Visits every leaf that has not converged, even leaves first. @return root mean square residual over the band, voxels
double BandSolver::sweep(float omega, double goal, Counts& counts) {
    const SchemeKernels& kernel = kernels();
    const auto visit_range = [&](std::size_t begin, std::size_t end) {
        return tbb::parallel_reduce(
            tbb::blocked_range<std::size_t>(begin, end, 8), std::int64_t(0),
            [&](const tbb::blocked_range<std::size_t>& range, std::int64_t visits) {
                for (std::size_t leaf = range.begin(); leaf != range.end(); ++leaf) {
                    if (!leaf_active_[leaf] || !is_unconverged(leaf, goal)) continue;
                    const std::size_t next = std::min(leaf + 1, end - 1);
                    prefetch(star_of(field_, next));
                    residuals_[leaf] =
                        kernel.relax(star_of(field_, leaf), previous_.leaf(leaf), rows(leaf), active(leaf), omega,
                                     kInnerSweeps, {previous_.leaf(next), rows(next)});
                    ++visits;
                }
                return visits;
            },
            std::plus<>());
    };
    const std::int64_t visits = visit_range(0, band_.odd_begin()) + visit_range(band_.odd_begin(), band_.size());
    ++counts.passes;
    counts.visits += visits;
    counts.visits_saved += static_cast<std::int64_t>(band_.size()) - visits;
    return root_mean_square();
}

Motion BandSolver::measure() {
    const BandValues now = values();
    tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
        LeafMotion& motion = motions_[leaf];
        if (!leaf_active_[leaf]) {
            motion = motion.without_motion();
            return;
        }
        motion = motion_of(now.leaf(leaf), previous_.leaf(leaf), now.in_domain(leaf));
    });
    return total(motions_);
}

void BandSolver::restore_previous() {
    tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
        if (leaf_active_[leaf]) std::copy_n(previous_.leaf(leaf), kLeafSize, field_.values.leaf(leaf));
    });
}

void BandSolver::store(FloatGrid& u) const {
    const auto h = static_cast<float>(domain_.voxel_size);
    tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
        auto* node = u.tree().probeLeaf(band_.origin(leaf));
        for (int n = 0; n < kLeafSize; ++n)
            if (node->isValueOn(n)) node->setValueOnly(n, h * field_.values.leaf(leaf)[n]);
    });
}

}  // namespace covol::detail
