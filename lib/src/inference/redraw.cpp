// A guess of another tool, redrawn by the image where marks say that it is wrong.
#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/geometry.h"
#include "base/median.h"
#include "covol/domain.h"
#include "covol/inference.h"
#include "covol/start.h"
#include "grid/levels_at.h"
#include "inference/appearance.h"
#include "inference/heuristics.h"
#include "inference/lattice.h"
#include "inference/minimal_surface.h"

namespace covol {
namespace {

using namespace inference;

/// A mark that the guess misses.
struct Miss {
    Vec3 place;      ///< of the frame
    double off = 0;  ///< how far from the guess
    bool outside = false;
};

Vec3 to_world(const ImageGeometry& g, const Vec3& place) {
    return g.index_to_world({place[0] / g.spacing[0], place[1] / g.spacing[1], place[2] / g.spacing[2]});
}

std::vector<char> inside_of(const FloatGrid& guess, const ImageGeometry& geometry, const Lattice& lattice) {
    std::vector<Vec3> places;
    places.reserve(lattice.count());
    for (std::size_t n = 0; n < lattice.count(); ++n) places.push_back(to_world(geometry, lattice.place_of(n)));
    std::vector<char> inside;
    for (const double level : detail::levels_at(guess, places)) inside.push_back(level < 0 ? 1 : 0);
    return inside;
}

Lattice around(const ImageGeometry& geometry, const std::vector<Miss>& misses, double reach) {
    Vec3 low = misses.front().place, high = low;
    for (const Miss& miss : misses)
        for (int a = 0; a < 3; ++a) {
            low[a] = std::min(low[a], miss.place[a]);
            high[a] = std::max(high[a], miss.place[a]);
        }
    for (int a = 0; a < 3; ++a) {
        low[a] -= reach;
        high[a] += reach;
    }
    return cover(geometry, low, high, kInference.fine_nodes);
}

class Redrawing {
public:
    Redrawing(const FloatGrid& guess, const Image& image, std::vector<Miss> misses, const RunContext& run)
        : run_(run),
          geometry_(image.geometry()),
          misses_(std::move(misses)),
          lattice_(around(geometry_, misses_, reach(geometry_, misses_))),
          inside_(inside_of(guess, geometry_, lattice_)),
          distance_(signed_distance(lattice_, inside_)),
          image_(lattice_, sample(image, lattice_, run)),
          freedom_(lattice_.count()),
          nearest_(lattice_.count()) {
        tbb::parallel_for(std::size_t(0), lattice_.count(), [&](std::size_t n) {
            const auto [in_misses, nearest] = nearest_miss(lattice_.place_of(n));
            freedom_[n] = float(in_misses);
            nearest_[n] = nearest;
        });
    }

    /// Of the box around the misses.
    [[nodiscard]] static double reach(const ImageGeometry& geometry, const std::vector<Miss>& misses) {
        double most = 0;
        for (const Miss& miss : misses) most = std::max(most, miss.off);
        return (kInference.redrawn + 1) * most +
               kInference.around_voxels * *std::min_element(geometry.spacing.begin(), geometry.spacing.end());
    }

    /// Bits that the image tells of the guess's sides where no mark speaks against it.
    double learn();
    void draw(const std::vector<Vec3>& inside, const std::vector<Vec3>& outside);
    /// In a guess's lattice, what was redrawn.
    [[nodiscard]] FloatGridPtr on(const FloatGrid& guess) const;
    [[nodiscard]] WorldBox box() const;
    [[nodiscard]] double distance_to_marks() const {
        const Field level = smoothed_level();
        double sum = 0;
        for (const Miss& miss : misses_) sum += std::abs(lattice_.value(level, miss.place)) / double(misses_.size());
        return sum;
    }

private:
    /// To the nearest mark that is missed, in what it is missed by.
    [[nodiscard]] std::pair<double, const Miss*> nearest_miss(const Vec3& place) const {
        std::pair<double, const Miss*> nearest{std::numeric_limits<double>::infinity(), nullptr};
        for (const Miss& miss : misses_) {
            const double to = length(minus(place, miss.place)) / miss.off;
            if (to < nearest.first) nearest = {to, &miss};
        }
        return nearest;
    }
    /// How sure the guess's side of a node is, in [0,1]: marks outside of it say that it is too small there, by so
    /// much, and those inside that it is too large.
    [[nodiscard]] double known(std::size_t n) const {
        const Miss& miss = *nearest_[n];
        if (miss.outside == (inside_[n] != 0)) return 1;
        const double deep = std::abs(double(distance_[n])) / miss.off;
        return std::clamp(std::max((double(freedom_[n]) - 1) / (kInference.redrawn - 1), 2 * (deep - 1)), 0.0, 1.0);
    }
    [[nodiscard]] Features features(std::size_t n) const {
        Features at{};
        for (int f = 0; f < kOfImage; ++f) at[std::size_t(f)] = image_[f][n];
        return at;
    }
    /// Within a cell.
    [[nodiscard]] std::vector<std::size_t> nodes_beside(const Vec3& place) const {
        std::vector<std::size_t> nodes;
        Index3 low, high;
        for (int a = 0; a < 3; ++a) {
            const double at = (place[a] - lattice_.origin[a]) / lattice_.spacing[a],
                         reach = lattice_.finest() / lattice_.spacing[a];
            const double last = lattice_.size[a] - 1;  // the place may lie anywhere
            low[a] = int(std::clamp(std::ceil(at - reach), 0.0, last + 1));
            high[a] = int(std::clamp(std::floor(at + reach), -1.0, last));
        }
        for (int k = low[2]; k <= high[2]; ++k)
            for (int j = low[1]; j <= high[1]; ++j)
                for (int i = low[0]; i <= high[0]; ++i)
                    if (length(minus(lattice_.place(i, j, k), place)) <= lattice_.finest())
                        nodes.push_back(lattice_.node(i, j, k));
        return nodes;
    }
    void keep_parts(std::vector<char>& body, bool of_inside) const;
    [[nodiscard]] Field smoothed_level() const {
        return smooth(lattice_, signed_distance(lattice_, body_), 0.7 * lattice_.finest());
    }

    const RunContext& run_;
    const ImageGeometry& geometry_;
    std::vector<Miss> misses_;
    Lattice lattice_;
    std::vector<char> inside_;
    Field distance_;
    ImageFeatures image_;
    Field freedom_;                     // distance to the nearest miss, in what it is missed by
    std::vector<const Miss*> nearest_;  // that one
    std::vector<Sample> samples_;
    std::vector<char> body_;
};

double Redrawing::learn() {
    constexpr std::size_t kOfEach = 600, kFewest = 100;
    constexpr int kFolds = 5;
    const double cell = lattice_.finest();
    for (const bool inside : {true, false}) {
        std::vector<std::size_t> nodes;
        for (std::size_t n = 0; n < lattice_.count(); ++n) {
            const double deep = std::abs(double(distance_[n])) / cell;
            if ((inside_[n] != 0) == inside && deep > 1 && deep < 8 && double(freedom_[n]) > kInference.redrawn)
                nodes.push_back(n);
        }
        const std::size_t count = std::min(kOfEach, nodes.size());
        for (std::size_t m = 0; m < count; ++m) {
            Sample s;
            s.at = features(nodes[(2 * m + 1) * nodes.size() / (2 * count)]);
            s.inside = inside;
            s.fold = int(m % kFolds);
            samples_.push_back(s);
        }
    }
    if (samples_.size() < kFewest) return 0;
    return held_out_bits(samples_, kInference.ridge, kFolds);
}

/// Parts that hang on nothing that is known: pieces without the guess's own inside, voids without its outside.
void Redrawing::keep_parts(std::vector<char>& body, bool of_inside) const {
    std::vector<char> side(body.size());
    for (std::size_t n = 0; n < body.size(); ++n) side[n] = (body[n] != 0) == of_inside ? 1 : 0;
    const Parts parts = label_parts(lattice_, side);
    std::vector<char> hangs(std::size_t(parts.count) + 1, 0);
    for (std::size_t n = 0; n < body.size(); ++n)
        if (double(freedom_[n]) > kInference.redrawn) hangs[std::size_t(parts.number[n])] = 1;
    for (std::size_t n = 0; n < body.size(); ++n)
        if (side[n] != 0 && hangs[std::size_t(parts.number[n])] == 0) body[n] = of_inside ? 0 : 1;
}

void Redrawing::draw(const std::vector<Vec3>& inside, const std::vector<Vec3>& outside) {
    const Appearance appearance(samples_, kInference.ridge);
    const double most = kInference.most_odds, cell = lattice_.finest();
    std::vector<double> slopes;
    for (const Miss& miss : misses_) slopes.push_back(lattice_.value(image_.slope(), miss.place));
    const double usual = std::max(cloud::median(slopes), 1e-6);
    Field cost(lattice_.count()), weight(lattice_.count()), u(lattice_.count());
    tbb::parallel_for(std::size_t(0), lattice_.count(), [&](std::size_t n) {
        const double sure = known(n);
        double odds = (inside_[n] != 0 ? 4 : -4) * most;
        if (sure < 1)
            odds = (1 - sure) * std::clamp(appearance.log_odds(features(n)), -most, most) +
                   sure * (inside_[n] != 0 ? most : -most);
        const double slope = double(image_.slope()[n]) / usual;
        cost[n] = float(-kInference.odds_weight * odds);
        weight[n] = float(1 / (1 + slope * slope));
        u[n] = odds > 0 ? 1.0F : 0.0F;
    });
    const auto hold = [&](const Vec3& place, double odds) {
        for (const std::size_t n : nodes_beside(place)) {
            cost[n] = float(-kInference.odds_weight * odds);
            weight[n] = 0;
        }
    };
    // Between a mark and the guess that misses it is what the guess lacks, or has too much.
    std::array<Field, 3> slope;
    for (int a = 0; a < 3; ++a) slope[std::size_t(a)] = derivative(lattice_, distance_, a);
    for (const Miss& miss : misses_) {
        Vec3 to_guess;
        for (int a = 0; a < 3; ++a)
            to_guess[a] = (miss.outside ? -1 : 1) * lattice_.value(slope[std::size_t(a)], miss.place);
        for (double way = 1.5 * cell; way < miss.off; way += 0.5 * cell)
            hold(plus(miss.place, way, unit(to_guess)), miss.outside ? most : -most);
    }
    for (const Vec3& world : inside) hold(to_frame(geometry_, world), 4 * most);
    for (const Vec3& world : outside) hold(to_frame(geometry_, world), -4 * most);
    minimize_surface(lattice_, weight, cost, kInference.iterations, u, run_);
    body_.resize(u.size());
    for (std::size_t n = 0; n < u.size(); ++n) body_[n] = u[n] > 0.5F ? 1 : 0;
    keep_parts(body_, true);
    keep_parts(body_, false);
}

WorldBox Redrawing::box() const {
    WorldBox box;
    bool first = true;
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3 world = to_world(geometry_, lattice_.place((corner & 1) != 0 ? lattice_.size[0] - 1 : 0,
                                                              (corner & 2) != 0 ? lattice_.size[1] - 1 : 0,
                                                              (corner & 4) != 0 ? lattice_.size[2] - 1 : 0));
        for (int a = 0; a < 3; ++a) {
            box.min[a] = first ? world[a] : std::min(box.min[a], world[a]);
            box.max[a] = first ? world[a] : std::max(box.max[a], world[a]);
        }
        first = false;
    }
    return box;
}

FloatGridPtr Redrawing::on(const FloatGrid& guess) const {
    const Field level = smoothed_level();
    const Domain domain = domain_of(guess);
    const double clamp = kHalfWidthVoxels * domain.voxel_size;
    FloatGridPtr result = guess.deepCopy();
    auto accessor = result->getAccessor();
    const WorldBox box = this->box();
    const Vec3 low = domain.world_to_index(box.min), high = domain.world_to_index(box.max);
    const auto first = [&](int a) { return std::max(domain.min[a], int(std::floor(low[a]))); };
    const auto last = [&](int a) { return std::min(domain.max[a], int(std::ceil(high[a]))); };
    for (int i = first(0); i <= last(0); ++i)
        for (int j = first(1); j <= last(1); ++j)
            for (int k = first(2); k <= last(2); ++k) {
                const Vec3 place = to_frame(geometry_, domain.index_to_world({double(i), double(j), double(k)}));
                if (nearest_miss(place).first > kInference.redrawn) continue;
                accessor.setValueOn({i, j, k}, float(std::clamp(lattice_.value(level, place), -clamp, clamp)));
            }
    return start_from_grid(domain, *result, run_);
}

}  // namespace

Redrawn redraw(const FloatGridPtr& guess, const std::vector<Vec3>& marks, const Image& image, const KnownSides& sides,
               const RunContext& run) {
    Redrawn result{guess, {}, 0, false, ""};
    const ImageGeometry& geometry = image.geometry();
    const double voxel = *std::min_element(geometry.spacing.begin(), geometry.spacing.end()),
                 widest = *std::max_element(geometry.spacing.begin(), geometry.spacing.end());
    const double missed = kInference.missed_voxels * std::max(voxel, 0.5 * widest),
                 clamp = kHalfWidthVoxels * guess->voxelSize()[0];
    std::vector<Miss> misses;
    const std::vector<double> levels = detail::levels_at(*guess, marks);
    for (std::size_t n = 0; n < marks.size(); ++n)
        if (std::abs(levels[n]) > std::min(missed, 0.9 * clamp))
            misses.push_back({to_frame(geometry, marks[n]), std::abs(levels[n]), levels[n] > 0});
    if (misses.empty()) {
        result.reason = "the guess passes the marks";
        return result;
    }
    with_threads(run, [&] {
        // A start is clamped: how far off a mark is, is measured anew.
        const Lattice wide = around(geometry, misses, kInference.farthest_miss * voxel);
        const Field distance = signed_distance(wide, inside_of(*guess, geometry, wide));
        for (Miss& miss : misses) miss.off = std::max(std::abs(wide.value(distance, miss.place)), miss.off);
        std::erase_if(misses, [&](const Miss& miss) { return miss.off <= missed; });
        if (misses.empty()) {
            result.reason = "the guess passes the marks";
            return;
        }
        if (is_too_large(around(geometry, misses, Redrawing::reach(geometry, misses)), geometry, run)) {
            result.reason = "the image's box around the marks that the guess misses is too large to be read as a whole";
            return;
        }
        Redrawing redrawing(*guess, image, misses, run);
        result.bits = redrawing.learn();
        if (result.bits < kInference.redraw_bits) {
            result.reason = "the image does not tell the sides of the guess";
            return;
        }
        redrawing.draw(sides.inside, sides.outside);
        double before = 0;
        for (const Miss& miss : misses) before += miss.off / double(misses.size());
        if (!(redrawing.distance_to_marks() < before)) {
            result.reason = "what the image shows does not pass the marks";
            return;
        }
        result.u = redrawing.on(*guess);
        result.box = redrawing.box();
        result.used = true;
        result.reason = "beside marks that the guess misses";
    });
    return result;
}

}  // namespace covol
