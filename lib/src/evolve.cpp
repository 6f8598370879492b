// The semi-implicit co-volume scheme of Kósa, Mikula et al., "3D image segmentation supported by a point cloud",
// Eqs. (14)-(22), on the active voxels of a narrow band:
//   u_p + Σ_q a_pq (u_q - u_p) = u_p^{n-1},   a_pq = (τ/h³) min(v_pq, 0) - (τδ/h²) M_p W_pq <= 0.
// One step assembles the rows of every leaf from u^{n-1}, then sweeps the leaves in two colours until the residual
// has fallen. The arithmetic on a leaf is in detail/scheme_kernels.cpp; here values are in voxels, not world units.
#include "covol/evolve.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>

#include "covol/band.h"
#include "covol/domain.h"
#include "covol/error.h"
#include "detail/follow.h"
#include "detail/halo.h"
#include "detail/leaf_propagation.h"
#include "detail/scheme.h"

namespace covol {
namespace {

using detail::Coord;
using detail::HaloField;
using detail::kLeafSize;
using detail::kPaddedSize;
using detail::LeafBand;
using detail::LeafBounds;
using detail::LeafMask;
using LeafNode = FloatGrid::TreeType::LeafNodeType;
using Clock = std::chrono::steady_clock;

constexpr int kInnerSweeps = 2;  // the second costs a fifth and saves a third of the visits
constexpr double kRounding = 5e-7;  // voxels; a residual below this is noise of single precision
constexpr double kMaxOmega = 1.9;
constexpr double kDiverged = 10.0;  // growth of the residual at which over-relaxation is given up
constexpr int kWindow = 10;  // steps

// When a follower's band is made again, voxels.
constexpr double kFollowMove = 0.75;
constexpr float kFollowDeep = 2.0F;
constexpr double kCrossingsPerVoxel = 1.5;  // edges crossed for each voxel of a surface that faces any way

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// 1 up to r/2, falling to 0 at r, and its integral from 0: the points pull along -taper(d) ∇d = -∇potential(d).
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

// Values of active voxels through `convert`, kUnknown elsewhere; a field is asked for only on the faces.
template <typename Convert>
HaloField gather_field(const LeafBand& band, const FloatGrid& grid, Convert convert) {
    return detail::gather(band, grid, false, [&](const LeafNode* leaf, float, float* block) {
        for (int n = 0; n < kLeafSize; ++n)
            block[n] = leaf != nullptr && leaf->isValueOn(n) ? static_cast<float>(convert(leaf->getValue(n)))
                                                             : detail::kUnknown;
    });
}

void check_finite(const LeafBand& band, const HaloField& field, const char* what) {
    for (std::size_t leaf = 0; leaf < band.size(); ++leaf)
        for (int n = 0; n < kLeafSize; ++n)
            if (detail::is_on(band.active(leaf), n) && !std::isfinite(field.values.leaf(leaf)[n])) {
                const Coord at = band.origin(leaf).offsetBy(n >> 6, (n >> 3) & 7, n & 7);
                std::ostringstream text;
                text << "evolve: " << what << ": expected finite values, got " << field.values.leaf(leaf)[n]
                     << " at voxel (" << at.x() << ", " << at.y() << ", " << at.z() << ")";
                throw Error(Errc::InvalidInput, text.str());
            }
}

double follow_clamp(const EvolveOptions& options) {
    return options.rho > 0 ? kHalfWidthVoxels : detail::kFollowWidth;
}

// What one step did to the surface.
struct Change {
    double mean = 0.0;  // motion of the zero crossings along voxel edges, voxels
    bool crosses = false;
    bool finite = true;
};

LeafMask negative_mask(const float* values) {
    LeafMask mask{};
    for (int n = 0; n < kLeafSize; ++n) mask[n >> 6] |= std::uint64_t(values[n] < 0.0F) << (n & 63);
    return mask;
}

// Voxels whose next voxel along an axis, in the same leaf, has the other sign.
LeafMask sign_changes(const LeafMask& negative, int axis) {
    static constexpr LeafMask kRest{};
    LeafMask changes = detail::looking_at(negative, kRest, axis, 1);
    for (int word = 0; word < 8; ++word) changes[word] ^= negative[word];
    // The last voxels along the axis have no next one here.
    if (axis == 0) changes[7] = 0;
    for (std::uint64_t& word : changes) word &= axis == 1 ? ~std::uint64_t(0) >> 8 : axis == 2 ? 0x7f7f7f7f7f7f7f7fULL : ~0ULL;
    return changes;
}

class Evolver {
public:
    Evolver(FloatGrid& u, const EvolveFields& fields, const EvolveOptions& options, const RunContext& run)
        : u_(u), fields_(fields), options_(options), run_(run), domain_(domain_of(u)), h_(domain_.voxel_size) {
        const double delta = options.delta < 0 ? h_ : options.delta;
        tau_ = options.tau < 0 ? 1.0 : options.tau / h_;
        constants_.tau = static_cast<float>(tau_);
        constants_.theta = static_cast<float>(options.theta);
        constants_.rho = static_cast<float>(options.rho);
        constants_.curvature = static_cast<float>(tau_ * delta / h_);
        constants_.epsilon2 = static_cast<float>(options.epsilon * options.epsilon);
        constants_.edge_epsilon2 = static_cast<float>(options.edge_epsilon * options.edge_epsilon);
        if (options.theta > 0) check_field(fields.distance, "distance", "theta");
        if (options.rho > 0) check_field(fields.edge, "edge", "rho");
        gather();
    }

    EvolveReport run() {
        report_.stop_reason = StopReason::MaxSteps;
        while (report_.steps < options_.max_steps) {
            if (run_.cancelled()) {
                report_.stop_reason = StopReason::Cancelled;
                break;
            }
            if (options_.follow && has_moved()) rebuild_band();
            const Change change = step();
            if (!change.finite) {
                restore_previous();
                store();
                throw Error(Errc::Numerical, "evolve: step " + std::to_string(report_.steps + 1) +
                                                 ": a value that is not finite appeared; u is as after the step before");
            }
            ++report_.steps;
            report_.last_change = change.mean;
            run_.report("evolve", progress());
            if (!change.crosses) {
                report_.stop_reason = StopReason::Vanished;
                break;
            }
            if (std::min(change.mean, net_motion()) < options_.tolerance * tau_) {
                report_.stop_reason = StopReason::Steady;
                break;
            }
        }
        store();
        report_.sweeps_per_step = report_.steps > 0 ? double(sweeps_) / report_.steps : 0.0;
        report_.active_voxels = band_.active_count();
        report_.leaf_count = static_cast<std::int64_t>(band_.size());
        return report_;
    }

private:
    void check_field(const FloatGrid* field, const char* name, const char* weight) const {
        if (field == nullptr)
            throw Error(Errc::InvalidInput, std::string("evolve: ") + weight + " > 0 needs the " + name + " grid, got none");
        const Domain other = domain_of(*field);
        double apart = std::abs(other.voxel_size - h_);
        for (int a = 0; a < 3; ++a) apart = std::max(apart, std::abs(other.origin[a] - domain_.origin[a]));
        if (apart > 1e-6 * h_)
            throw Error(Errc::InvalidInput, std::string("evolve: expected one transform for all grids, but that of ") + name +
                                                " differs from u's");
    }

    // Everything that hangs on the band's topology.
    void gather() {
        band_ = LeafBand(u_);
        active_count_ = band_.active_count();
        if (active_count_ == 0) throw Error(Errc::InvalidInput, "evolve: expected active voxels in u, got none");
        const auto scale = static_cast<float>(1.0 / h_);
        field_ = detail::gather(band_, u_, true, [scale](const LeafNode* leaf, float tile, float* block) {
            for (int n = 0; n < kLeafSize; ++n) block[n] = scale * (leaf != nullptr ? leaf->getValue(n) : tile);
        });
        check_finite(band_, field_, "u");
        gather_fields();
        if (options_.follow) remember_surface();
        window_.clear();
        previous_ = detail::LeafArray<float>(band_.size(), 0.0F, 0);
        rows_.resize(band_.size() * 6 * kLeafSize);
        residuals_.assign(band_.size(), 0.0);
    }

    void gather_fields() {
        const Taper taper{options_.attraction_range};
        if (options_.theta > 0) {
            phi_ = gather_field(band_, *fields_.distance, [&](float d) { return taper.potential(d) / h_; });
            check_finite(band_, *phi_, "distance");
        }
        if (options_.rho > 0) {
            edge_ = gather_field(band_, *fields_.edge, [](float g) { return g; });
            check_finite(band_, *edge_, "edge");
        }
        if (options_.rho > 0 && options_.image_yields > 0 && fields_.distance != nullptr)
            image_weight_ = detail::gather(band_, *fields_.distance, false, [&](const LeafNode* leaf, float, float* block) {
                for (int n = 0; n < kLeafSize; ++n)  // far from every mark where the distance is not known
                    block[n] = leaf != nullptr && leaf->isValueOn(n)
                                   ? static_cast<float>(1.0 - options_.image_yields * taper(leaf->getValue(n)))
                                   : 1.0F;
            });
    }

    void rebuild_band() {
        store();
        detail::follow_surface(u_, domain_, follow_clamp(options_), run_);
        if (fields_.extend) fields_.extend(u_, fields_);
        gather();
    }

    Change step() {
        const auto start = Clock::now();
        const double largest_row = assemble();
        report_.seconds_assembly += seconds_since(start);
        const auto solve_start = Clock::now();
        // The largest row belongs to some voxel on the edge of the plateau, where W is of order 1/ε; relaxing for it
        // costs every other voxel sweeps. In a band that is frozen on both sides 4/6 of a regular row serves best.
        const double regular_row = 4.0 * constants_.curvature + 2.0 * tau_ * (options_.theta + options_.rho);
        const double row = std::min(largest_row, regular_row);
        const double jacobi = row / (1.0 + row);
        double omega = std::min(kMaxOmega, 2.0 / (1.0 + std::sqrt(1.0 - jacobi * jacobi)));
        double first = 0.0;
        for (int visit = 0; visit * kInnerSweeps < options_.max_sweeps; ++visit) {
            const double residual = sweep(static_cast<float>(omega));
            ++sweeps_;
            if (visit == 0) first = residual;
            if (omega > 1.0 && !(residual <= kDiverged * first)) {
                // Over-relaxation may fail where advection dominates; Gauss-Seidel converges on every M-matrix.
                omega = 1.0;
                restore_previous();
                continue;
            }
            if (!(residual > std::max(options_.solver_tolerance * first, kRounding))) break;
        }
        report_.seconds_sweeps += seconds_since(solve_start);
        return measure_change();
    }

    double assemble() {
        const detail::SchemeKernels& kernels = detail::kernels();
        tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
            alignas(64) float u[kPaddedSize], phi[kPaddedSize], edge[kPaddedSize];
            std::copy_n(field_.values.leaf(leaf), kLeafSize, previous_.leaf(leaf));
            residuals_[leaf] = 0.0;
            if (!detail::any_on(band_.active(leaf))) return;
            const LeafBounds bounds(domain_, band_.origin(leaf));
            detail::load_padded(field_, leaf, u);
            if (phi_) detail::load_star(*phi_, leaf, phi);
            if (edge_) detail::load_star(*edge_, leaf, edge);
            if (bounds.cuts()) {
                detail::mirror_outside(u, bounds.lo, bounds.hi);
                if (phi_) detail::mirror_outside(phi, bounds.lo, bounds.hi);
                if (edge_) detail::mirror_outside(edge, bounds.lo, bounds.hi);
            }
            residuals_[leaf] = kernels.assemble(u, phi_ ? phi : nullptr, edge_ ? edge : nullptr,
                                                image_weight_ ? image_weight_->values.leaf(leaf) : nullptr, active(leaf),
                                                constants_, rows(leaf));
            if (bounds.cuts()) detail::close_faces(rows(leaf), bounds.lo, bounds.hi);
        });
        return *std::max_element(residuals_.begin(), residuals_.end());
    }

    // Visits every leaf once, even leaves first. @return root mean square residual over the band, voxels
    double sweep(float omega) {
        const detail::SchemeKernels& kernels = detail::kernels();
        const auto visit = [&](std::size_t leaf) {
            alignas(64) float u[kPaddedSize];
            detail::load_star(field_, leaf, u);
            residuals_[leaf] = kernels.relax(u, previous_.leaf(leaf), rows(leaf), active(leaf), omega, kInnerSweeps);
            detail::store_inner(u, field_.values.leaf(leaf));
        };
        tbb::parallel_for(std::size_t(0), band_.odd_begin(), visit);
        tbb::parallel_for(band_.odd_begin(), band_.size(), visit);
        report_.leaf_visits += static_cast<std::int64_t>(band_.size());
        double sum = 0.0;
        for (const double r : residuals_) sum += r;
        return std::sqrt(sum / static_cast<double>(active_count_));
    }

    // Where an edge is crossed before and after, the crossing's way; where only once, half an edge. Unlike the change of
    // u this does not see a profile that grows steeper in its place.
    Change measure_change() {
        struct Part {
            double way = 0.0;
            int edges = 0;
            bool negative = false, positive = false, finite = true;
        };
        std::vector<Part> parts(band_.size());
        tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
            const float* now = field_.values.leaf(leaf);
            const float* before = previous_.leaf(leaf);
            Part& part = parts[leaf];
            // A sum is finite when every value is, and takes no branches.
            float sum = 0.0F;
            for (int n = 0; n < kLeafSize; ++n) sum += now[n];
            part.finite = std::isfinite(sum);
            const LeafMask negative = negative_mask(now), was_negative = negative_mask(before);
            for (int word = 0; word < 8; ++word) {
                part.negative |= negative[word] != 0;
                part.positive |= ~negative[word] != 0;
            }
            if (!detail::any_on(band_.active(leaf)) || (negative == was_negative && !(part.negative && part.positive))) return;
            for (int axis = 0; axis < 3; ++axis) {
                const LeafMask after = sign_changes(negative, axis), first = sign_changes(was_negative, axis);
                const int step = 64 >> (3 * axis);
                for (int word = 0; word < 8; ++word)
                    for (std::uint64_t bits = after[word] | first[word]; bits != 0; bits &= bits - 1) {
                        const int n = word << 6 | __builtin_ctzll(bits);
                        ++part.edges;
                        part.way += detail::is_on(after, n) && detail::is_on(first, n)
                                        ? std::abs(crossing(now[n], now[n + step]) - crossing(before[n], before[n + step]))
                                        : 0.5;
                    }
            }
        });
        Change change;
        double way = 0.0;
        std::int64_t edges = 0;
        bool negative = false, positive = false;
        for (const Part& part : parts) {
            way += part.way;
            edges += part.edges;
            negative |= part.negative;
            positive |= part.positive;
            change.finite &= part.finite;
        }
        change.crosses = negative && positive;
        change.mean = edges > 0 ? way / static_cast<double>(edges) : 0.0;
        return change;
    }

    // Mean motion per step over the last kWindow steps, by the voxels that changed sign for good. Next to an edge of the
    // image the crossings tremble by a few hundredths of a voxel; that ends no run, and moves nothing.
    double net_motion() {
        if (++window_age_ < kWindow && !window_.empty()) return std::numeric_limits<double>::infinity();
        const bool is_first = window_.size() != band_.size();
        window_.resize(band_.size());
        std::int64_t flipped = 0, crossed = 0;
        for (std::size_t leaf = 0; leaf < band_.size(); ++leaf) {
            const LeafMask negative = negative_mask(field_.values.leaf(leaf));
            for (int word = 0; word < 8; ++word) flipped += __builtin_popcountll(negative[word] ^ window_[leaf][word]);
            for (int axis = 0; axis < 3; ++axis) crossed += detail::count_on(sign_changes(negative, axis));
            window_[leaf] = negative;
        }
        window_age_ = 0;
        if (is_first || crossed == 0) return std::numeric_limits<double>::infinity();
        return kCrossingsPerVoxel * double(flipped) / double(crossed) / kWindow;
    }

    static double crossing(float a, float b) { return double(a) / (double(a) - b); }

    // What the band was made for, as signs; see has_moved().
    void remember_surface() {
        made_for_.resize(band_.size());
        tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
            const float* values = field_.values.leaf(leaf);
            MadeFor& made = made_for_[leaf];
            made.negative = negative_mask(values);
            made.near = {};
            for (int n = 0; n < kLeafSize; ++n)
                made.near[n >> 6] |= std::uint64_t(std::abs(values[n]) < kFollowDeep) << (n & 63);
            made.crossed = 0;
            for (int axis = 0; axis < 3; ++axis) made.crossed += detail::count_on(sign_changes(made.negative, axis));
        });
    }

    // The surface has left what its band was made for: on the average by kFollowMove voxels, counted by the voxels that
    // changed sign, or somewhere past voxels that were kFollowDeep away.
    [[nodiscard]] bool has_moved() const {
        std::int64_t flipped = 0, crossed = 0;
        for (std::size_t leaf = 0; leaf < band_.size(); ++leaf) {
            const MadeFor& made = made_for_[leaf];
            const LeafMask negative = negative_mask(field_.values.leaf(leaf));
            for (int word = 0; word < 8; ++word) {
                const std::uint64_t flips = negative[word] ^ made.negative[word];
                if ((flips & ~made.near[word]) != 0) return true;
                flipped += __builtin_popcountll(flips);
            }
            crossed += made.crossed;
        }
        return static_cast<double>(flipped) >= kFollowMove * static_cast<double>(crossed) / kCrossingsPerVoxel;
    }

    void restore_previous() {
        tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
            std::copy_n(previous_.leaf(leaf), kLeafSize, field_.values.leaf(leaf));
        });
    }

    // Active voxels back into the grid; inactive ones keep their bits.
    void store() {
        const auto h = static_cast<float>(h_);
        tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
            auto* node = u_.tree().probeLeaf(band_.origin(leaf));
            for (int n = 0; n < kLeafSize; ++n)
                if (node->isValueOn(n)) node->setValueOnly(n, h * field_.values.leaf(leaf)[n]);
        });
    }

    // Steps and the fall of the change, whichever is further.
    [[nodiscard]] double progress() const {
        const double by_steps = double(report_.steps) / options_.max_steps;
        if (!(report_.last_change > 0) || !(options_.tolerance > 0)) return by_steps;
        const double by_change = std::log(report_.last_change / tau_) / std::log(options_.tolerance);
        return std::clamp(std::max(by_steps, by_change), 0.0, 1.0);
    }

    [[nodiscard]] const unsigned long long* active(std::size_t leaf) const {
        return reinterpret_cast<const unsigned long long*>(band_.active(leaf).data());
    }
    [[nodiscard]] float* rows(std::size_t leaf) { return rows_.data() + leaf * 6 * kLeafSize; }

    FloatGrid& u_;
    EvolveFields fields_;
    const EvolveOptions& options_;
    const RunContext& run_;
    const Domain domain_;
    const double h_;
    double tau_ = 1.0;  // in h
    detail::SchemeConstants constants_{};

    LeafBand band_;
    std::int64_t active_count_ = 0;
    HaloField field_;                       // u, voxels
    std::optional<HaloField> phi_, edge_, image_weight_;
    detail::LeafArray<float> previous_;     // u^{n-1}
    std::vector<float, tbb::cache_aligned_allocator<float>> rows_;  // 6 x 512 for each leaf
    struct MadeFor {
        LeafMask negative, near;
        int crossed;
    };
    std::vector<MadeFor> made_for_;         // for each leaf, with `follow`
    std::vector<LeafMask> window_;          // signs kWindow steps ago or less
    int window_age_ = 0;
    std::vector<double> residuals_;         // scratch, one number for each leaf
    std::int64_t sweeps_ = 0;
    EvolveReport report_;
};

void expect(std::string& lines, bool ok, const char* field, const char* expected, double got) {
    if (ok) return;
    std::ostringstream line;
    line << (lines.empty() ? "" : "\n") << field << ": expected " << expected << ", got " << got;
    lines += line.str();
}

}  // namespace

std::string EvolveOptions::why_invalid() const {
    std::string lines;
    const auto unit = [](double x) { return x >= 0 && x <= 1; };
    expect(lines, unit(theta), "theta", "0 to 1", theta);
    expect(lines, unit(rho), "rho", "0 to 1", rho);
    expect(lines, std::isfinite(delta), "delta", "a finite number", delta);
    expect(lines, std::isfinite(tau) && tau != 0, "tau", "> 0", tau);
    expect(lines, epsilon > 0 && std::isfinite(epsilon), "epsilon", "> 0", epsilon);
    expect(lines, edge_epsilon > 0 && std::isfinite(edge_epsilon), "edge_epsilon", "> 0", edge_epsilon);
    expect(lines, attraction_range >= 0 && std::isfinite(attraction_range), "attraction_range", ">= 0", attraction_range);
    expect(lines, unit(image_yields), "image_yields", "0 to 1", image_yields);
    expect(lines, max_steps >= 0, "max_steps", ">= 0", max_steps);
    expect(lines, tolerance >= 0 && std::isfinite(tolerance), "tolerance", ">= 0", tolerance);
    expect(lines, solver_tolerance > 0 && solver_tolerance < 1, "solver_tolerance", "between 0 and 1", solver_tolerance);
    expect(lines, max_sweeps >= 1, "max_sweeps", ">= 1", max_sweeps);
    return lines;
}

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
    if (const std::string why = options.why_invalid(); !why.empty()) throw Error(Errc::InvalidOptions, "evolve: " + why);
    EvolveReport report;
    with_threads(run, [&] {
        u.tree().voxelizeActiveTiles();
        if (options.follow) detail::follow_surface(u, domain_of(u), follow_clamp(options), run);
        report = Evolver(u, fields, options, run).run();
    });
    return report;
}

}  // namespace covol
