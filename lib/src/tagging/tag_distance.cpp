// The choice of the tag distance D: 0-dimensional persistence of the superlevel sets {d > D}.
//
// As D falls, components of {d > D} are born at peaks of d and merge at saddles. One component, the exterior, is there
// from the start; every other one is an enclosed core until it merges with the exterior: there its last gap opens. The
// saddle is the D below which the core leaks. See Edelsbrunner and Harer, "Computational Topology" (2010), chapter VII.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>

#include "covol/band.h"
#include "covol/distance.h"
#include "covol/error.h"
#include "covol/points.h"
#include "grid/leaf_columns.h"
#include "tagging/heuristics.h"

namespace covol {
namespace {

using detail::Coord;
using detail::kLeafSize;

/// An enclosed core, at the moment when it merges with the exterior. Lengths in voxels of the analysis grid.
struct Core {
    double saddle = 0, peak = 0;
    double volume = 0, area = 0;

    /// The core grown by its saddle, as a ball of the same area per volume would grow.
    [[nodiscard]] double growth() const { return 1.0 + saddle * area / (3.0 * volume); }
    [[nodiscard]] double full_volume() const { return volume * std::pow(growth(), 3); }
    [[nodiscard]] double full_area() const { return area * std::pow(growth(), 2); }
};

struct Analysis {
    std::vector<Core> cores;
    double cloud_volume(double distance) const;  ///< of {d <= distance}
    std::vector<std::int64_t> histogram;         ///< tube voxels by bucket
    std::int64_t tube_voxels = 0;
};

double Analysis::cloud_volume(double distance) const {
    double n = 0;
    for (std::size_t bucket = 0;
         bucket < histogram.size() && double(bucket) < distance * kTagDistance.buckets_per_voxel; ++bucket)
        n += double(histogram[bucket]);
    return n;
}

constexpr std::int32_t kExterior = 0;  ///< the first component

/// Components under merging, with what a core is judged by.
class Components {
public:
    explicit Components(std::vector<Core>& cores) : cores_(cores) { create(std::numeric_limits<double>::max(), true); }

    std::int32_t create(double peak, bool exterior) {
        components_.push_back({std::int32_t(components_.size()), exterior, peak, 0, 0});
        return components_.back().parent;
    }
    std::int32_t find(std::int32_t c) {
        while (components_[c].parent != c) c = components_[c].parent = components_[components_[c].parent].parent;
        return c;
    }
    void grow(std::int32_t root, std::int64_t voxels, std::int64_t faces) {
        components_[root].voxels += voxels;
        components_[root].faces += faces;
    }
    void mark_exterior(std::int32_t root) { components_[root].exterior = true; }
    /// Merges two roots at distance d. Unless `silent`, a core that meets the exterior is recorded.
    std::int32_t merge(std::int32_t a, std::int32_t b, double d, bool silent) {
        if (a == b) return a;
        Component &first = components_[a], &second = components_[b];
        if (first.exterior != second.exterior && !silent) record(first.exterior ? second : first, d);
        const bool keep_first = first.peak >= second.peak;
        Component &kept = keep_first ? first : second, &gone = keep_first ? second : first;
        kept.exterior = kept.exterior || gone.exterior;
        kept.voxels += gone.voxels;
        kept.faces += gone.faces;
        gone.parent = kept.parent;
        return kept.parent;
    }
    /// Cores that never met the exterior.
    void finish() {
        for (const Component& c : components_)
            if (&c == &components_[c.parent] && !c.exterior) record(c, 0.0);
    }

private:
    struct Component {
        std::int32_t parent;
        bool exterior;
        double peak;
        std::int64_t voxels, faces;
    };
    void record(const Component& c, double d) {
        // A voxel surface has 3/2 of a smooth surface's area, on average over directions.
        if (c.voxels > 0) cores_.push_back({d, c.peak, double(c.voxels), double(c.faces) * 2.0 / 3.0});
    }
    std::vector<Core>& cores_;
    std::vector<Component> components_;
};

/// The persistence sweep over one grid.
class Sweep {
public:
    Sweep(const FloatGrid& distance, double radius, const std::vector<Vec3>& seeds)
        : box_(detail::box_of(domain_of(distance))),
          inner_(box_.min().offsetBy(1), box_.max().offsetBy(-1)),
          band_(distance),
          columns_(band_, box_),
          d_(band_.size(), 0.0F),
          label_(band_.size(), -1),
          run_label_(columns_.pieces().size(), -1),
          components_(result_.cores),
          h_(domain_of(distance).voxel_size),
          radius_(radius / h_) {
        detail::import_values(distance, band_, d_);
        const Domain domain = domain_of(distance);
        for (const Vec3& seed : seeds) {
            const Vec3 at = domain.world_to_index(seed);
            seeds_.push_back(Coord(int(std::lround(at[0])), int(std::lround(at[1])), int(std::lround(at[2]))));
        }
        link();
    }

    Analysis run() {
        enter_runs();
        const std::vector<std::int32_t> order = sorted_voxels();
        for (const std::int32_t node : order) enter_voxel(node);
        components_.finish();
        return std::move(result_);
    }

private:
    void link();
    void enter_runs();
    std::vector<std::int32_t> sorted_voxels();
    void enter_voxel(std::int32_t node);
    /// The component of the voxel beyond face `face` of voxel `at` of a leaf; -1: none yet.
    std::int32_t neighbour_label(std::int32_t leaf, int at, int face) const;
    int bucket_of(float d) const { return int(double(d) / h_ * kTagDistance.buckets_per_voxel); }

    const detail::CoordBBox box_, inner_;
    const detail::LeafBand band_;
    const detail::LeafColumns columns_;
    detail::LeafArray<float> d_;
    detail::LeafArray<std::int32_t> label_;
    std::vector<std::int32_t> run_label_;
    std::vector<std::array<std::int32_t, 6>> beyond_;  // by leaf and face: a leaf, ~piece of a run, or kNothing
    std::vector<Coord> seeds_;
    Analysis result_;
    Components components_;
    double h_, radius_;  // radius in voxels
    static constexpr std::int32_t kNothing = std::numeric_limits<std::int32_t>::max();
};

int face_number(int di, int dj, int dk) { return di != 0 ? (di > 0) : dj != 0 ? 2 + (dj > 0) : 4 + (dk > 0); }

void Sweep::link() {
    std::array<std::int32_t, 6> nothing;
    nothing.fill(kNothing);
    beyond_.assign(band_.size(), nothing);
    for (std::size_t leaf = 0; leaf < band_.size(); ++leaf)
        columns_.for_each_neighbour(columns_.piece_of_leaf(leaf), [&](std::int32_t other, int di, int dj, int dk) {
            const std::int32_t there = columns_.pieces()[other].leaf;
            beyond_[leaf][face_number(di, dj, dk)] = there >= 0 ? there : ~other;
        });
}

void Sweep::enter_runs() {
    const auto& pieces = columns_.pieces();
    for (std::int32_t n = 0; n < std::int32_t(pieces.size()); ++n) {
        if (pieces[n].leaf >= 0) continue;
        const bool has_seed =
            std::any_of(seeds_.begin(), seeds_.end(), [&](const Coord& s) { return columns_.find(s) == n; });
        std::int32_t root =
            columns_.at_border(pieces[n]) ? components_.find(kExterior) : components_.create(radius_, has_seed);
        run_label_[n] = root;
        const std::int64_t blocks = pieces[n].end - pieces[n].begin;
        components_.grow(root, blocks * kLeafSize, 0);
        columns_.for_each_neighbour(n, [&](std::int32_t other, int, int, int) {
            if (run_label_[other] >= 0)
                root = components_.merge(root, components_.find(run_label_[other]), radius_, true);
        });
    }
    // Where a run meets a leaf, faces show until the leaf's voxels come; between runs there are none.
    for (std::size_t leaf = 0; leaf < band_.size(); ++leaf)
        for (const std::int32_t other : beyond_[leaf])
            if (other < 0) components_.grow(components_.find(run_label_[~other]), 0, 64);
}

/// Voxels of the domain by falling d; the order within a bucket is theirs in memory.
std::vector<std::int32_t> Sweep::sorted_voxels() {
    const int buckets = bucket_of(float(radius_ * h_)) + 2;  // the last: beyond the tube
    result_.histogram.assign(buckets, 0);
    std::vector<std::uint16_t> bucket(band_.size() * kLeafSize);
    constexpr std::uint16_t kOutside = 0xffff;
    tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
        const detail::LeafMask inside = detail::mask_in_box(band_.origin(leaf), box_);
        for (int at = 0; at < kLeafSize; ++at) {
            int b = buckets - 1;
            if (detail::is_on(band_.active(leaf), at)) b = std::min(bucket_of(d_.leaf(leaf)[at]), buckets - 2);
            bucket[leaf * kLeafSize + at] = detail::is_on(inside, at) ? std::uint16_t(b) : kOutside;
        }
    });
    for (const std::uint16_t b : bucket)
        if (b != kOutside) ++result_.histogram[b];
    std::vector<std::int64_t> start(buckets + 1, 0);
    for (int b = buckets - 1; b >= 0; --b) start[b] = start[b + 1] + result_.histogram[b];
    std::vector<std::int32_t> order(start[0]);
    for (std::size_t node = 0; node < bucket.size(); ++node)
        if (bucket[node] != kOutside) order[start[bucket[node] + 1]++] = std::int32_t(node);
    result_.tube_voxels = std::int64_t(order.size()) - result_.histogram.back();
    return order;
}

std::int32_t Sweep::neighbour_label(std::int32_t leaf, int at, int face) const {
    constexpr int kShift[3] = {6, 3, 0};
    const int shift = kShift[face / 2], c = at >> shift & 7;
    const bool up = face & 1;
    if (up ? c < 7 : c > 0) return label_.leaf(leaf)[up ? at + (1 << shift) : at - (1 << shift)];
    const std::int32_t other = beyond_[leaf][face];
    if (other == kNothing) return -1;
    if (other < 0) return run_label_[~other];
    return label_.leaf(other)[up ? at - (7 << shift) : at + (7 << shift)];
}

void Sweep::enter_voxel(std::int32_t node) {
    const std::int32_t leaf = node / kLeafSize;
    const int at = node % kLeafSize;
    const bool is_beyond = !detail::is_on(band_.active(leaf), at);
    const double d = is_beyond ? radius_ : double(d_.leaf(leaf)[at]) / h_;
    std::int32_t root = -1, last = -1;
    int known = 0;
    for (int face = 0; face < 6; ++face) {
        const std::int32_t label = neighbour_label(leaf, at, face);
        if (label < 0) continue;
        ++known;
        if (label == last) continue;
        last = label;
        const std::int32_t other = components_.find(label);
        root = root < 0 ? other : components_.merge(root, other, d, is_beyond);
    }
    const Coord voxel = band_.origin(leaf).offsetBy(at >> 6, at >> 3 & 7, at & 7);
    const bool at_boundary = !inner_.isInside(voxel);
    if (root < 0) root = at_boundary ? kExterior : components_.create(d, false);
    components_.grow(root, 1, 6 - 2 * known);
    label_.leaf(leaf)[at] = root;
    // Beyond the boundary lies the exterior: a voxel there is a gap like any other. A seed only says what its core is.
    if (at_boundary) components_.merge(root, components_.find(kExterior), d, is_beyond);
    if (std::find(seeds_.begin(), seeds_.end(), voxel) != seeds_.end())
        components_.mark_exterior(components_.find(root));
}

/// The grid to analyse on: the points' box, as far as it lies in the domain, and two voxels around it.
Domain analysis_domain(const std::vector<Vec3>& points, const Domain& domain, double voxel_size) {
    WorldBox box = bounding_box(points, 2 * voxel_size);
    const WorldBox limit = domain.world_box();
    for (int a = 0; a < 3; ++a) {
        box.min[a] = std::max(box.min[a], limit.min[a]);
        box.max[a] = std::min(box.max[a], limit.max[a]);
        if (!(box.max[a] > box.min[a]))
            throw Error(Errc::InvalidInput, "choose_tag_distance: no point lies in the domain");
    }
    return make_domain(box, voxel_size);
}

/// Distance at which the main cores are closed, voxels; 0 when nothing but pockets is enclosed.
struct Verdict {
    double saddle = 0;
    double peak = 0;  ///< of the most important core
    int cores = 0;
};

Verdict judge(const Analysis& analysis) {
    Verdict verdict;
    const auto cloud_area = [&](double saddle) {
        const double thickness = std::max(saddle, 1.0);
        return analysis.cloud_volume(thickness) / (2 * thickness);
    };
    const auto is_significant = [&](const Core& c) {
        // Below half a voxel the grid itself closes the gap.
        const double ratio = c.peak / std::max(c.saddle, 0.5);
        return c.peak >= 1.0 && (ratio >= kTagDistance.clear_ratio ||
                                 (ratio >= kTagDistance.significant_ratio &&
                                  c.full_area() >= kTagDistance.large_share * cloud_area(c.saddle)));
    };
    const Core* primary = nullptr;
    for (const Core& c : analysis.cores)
        if (is_significant(c) && (!primary || c.full_volume() > primary->full_volume())) primary = &c;
    if (!primary) return verdict;
    double area = 0;
    for (const Core& c : analysis.cores) {
        if (!is_significant(c) || c.full_volume() < kTagDistance.important_share * primary->full_volume()) continue;
        verdict.saddle = std::max(verdict.saddle, c.saddle);
        area += c.full_area();
        ++verdict.cores;
    }
    verdict.peak = primary->peak;
    return area < kTagDistance.structure_share * cloud_area(verdict.saddle) ? Verdict{} : verdict;
}

}  // namespace

TagDistanceChoice choose_tag_distance(const std::vector<Vec3>& points, const Domain& domain,
                                      const std::vector<Vec3>& exterior_seeds, const RunContext& run) {
    if (points.empty()) throw Error(Errc::InvalidInput, "choose_tag_distance: expected at least one point, got none");
    const double h = domain.voxel_size;
    const WorldBox box = bounding_box(points);
    const double extent = std::max({box.max[0] - box.min[0], box.max[1] - box.min[1], box.max[2] - box.min[2], h});
    double volume = 1;
    for (int a = 0; a < 3; ++a) volume *= std::max(box.max[a] - box.min[a], extent / 64);
    double a = std::max(h, std::cbrt(volume / double(kTagDistance.coarse_voxels)));
    double radius = extent;
    TagDistanceChoice choice;
    std::ostringstream reason;
    for (;;) {
        run.check();
        const DistanceResult tube = compute_distance(points, analysis_domain(points, domain, a), {radius}, run);
        if (tube.grid->tree().leafCount() == 0) break;
        const Analysis analysis = Sweep(*tube.grid, radius, exterior_seeds).run();
        const Verdict verdict = judge(analysis);
        if (verdict.cores > 0) {
            choice.tag_distance = std::max(1.05 * verdict.saddle * a + 0.5 * a, 1.5 * h);
            choice.encloses = true;
            reason.str({});
            reason << "closes " << verdict.cores << (verdict.cores == 1 ? " core" : " cores")
                   << " whose largest gap has radius " << verdict.saddle * a << " (inner radius " << verdict.peak * a
                   << "), seen on a grid of " << a;
        }
        const double finer = std::max(h, 0.5 * a);
        const bool is_resolved = verdict.cores > 0 && verdict.saddle >= 2.5;
        const double next_voxels = double(analysis.tube_voxels) * (a / finer) * (a / finer);
        if (is_resolved || !(finer < a) || next_voxels > double(kTagDistance.max_tube_voxels)) break;
        a = finer;
        radius = std::max(1.3 * choice.tag_distance, 4 * a);
    }
    if (choice.tag_distance == 0) {
        const double spacing = measure_spacing(merge_close_points(points, 0.0)).mean;
        choice.tag_distance = std::max(1.8 * spacing, 1.5 * h);
        reason << "no closed structure found; 1.8 times the mean spacing " << spacing;
    }
    choice.reason = reason.str();
    return choice;
}

}  // namespace covol
