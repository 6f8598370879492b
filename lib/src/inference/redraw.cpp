// Redraws a given guess, such as the result of another tool, from the image near the marks that it misses.
#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "base/number.h"
#include "covol/domain.h"
#include "covol/inference.h"
#include "covol/start.h"
#include "grid/levels_at.h"
#include "inference/candidate.h"
#include "inference/heuristics.h"

namespace covol {
namespace {

using namespace inference;

/// A mark that the guess misses.
struct Miss {
    Vec3 place;      ///< its position in the image's frame
    double off = 0;  ///< its distance from the surface of the guess
    bool outside = false;
};

std::vector<Vec3> places_of(const std::vector<Miss>& misses) {
    std::vector<Vec3> places;
    for (const Miss& miss : misses) places.push_back(miss.place);
    return places;
}

Solid solid_of(const FloatGrid& guess, const ImageGeometry& geometry, const Lattice& lattice) {
    Solid solid{lattice, {}};
    for (const double level : levels_on(lattice, geometry, guess)) solid.inside.push_back(level < 0 ? 1 : 0);
    return solid;
}

Lattice around(const ImageGeometry& geometry, const std::vector<Miss>& misses, double reach) {
    const WorldBox box = bounding_box(places_of(misses), reach);
    return cover(geometry, box.min, box.max, fine_nodes());
}

class Redrawing {
public:
    Redrawing(const FloatGrid& guess, const Image& image, std::vector<Miss> misses, const Lattice& lattice,
              const RunContext& run)
        : run_(run),
          geometry_(image.geometry()),
          misses_(std::move(misses)),
          lattice_(lattice),
          guess_(solid_of(guess, geometry_, lattice_)),
          distance_(signed_distance(lattice_, guess_.inside)),
          image_(lattice_, sample(image, lattice_, run)),
          freedom_(lattice_.count()),
          nearest_(lattice_.count()) {
        tbb::parallel_for(std::size_t(0), lattice_.count(), [&](std::size_t n) {
            const auto [in_misses, nearest] = nearest_miss(lattice_.place_of(n));
            freedom_[n] = float(in_misses);
            nearest_[n] = nearest;
        });
    }

    /// Collects samples on both sides of the guess's surface where no mark contradicts it. @return the bits of
    /// information that the image gives about their side: held_out_bits()
    double learn();
    void draw(const std::vector<Vec3>& inside, const std::vector<Vec3>& outside);
    /// The level set of the guess, with the redrawn part of its surface.
    [[nodiscard]] FloatGridPtr on(const FloatGrid& guess) const;
    [[nodiscard]] WorldBox box() const;
    /// Mean distance of the redrawn surface to the marks that the guess misses.
    [[nodiscard]] double distance_to_marks() const {
        double sum = 0;
        for (const Miss& miss : misses_) sum += std::abs(lattice_.value(level_, miss.place)) / double(misses_.size());
        return sum;
    }

private:
    /// The missed mark that is nearest relative to the distance by which the guess misses it, and this relative
    /// distance.
    [[nodiscard]] std::pair<double, const Miss*> nearest_miss(const Vec3& place) const {
        std::pair<double, const Miss*> nearest{std::numeric_limits<double>::infinity(), nullptr};
        for (const Miss& miss : misses_) {
            const double to = length(minus(place, miss.place)) / miss.off;
            if (to < nearest.first) nearest = {to, &miss};
        }
        return nearest;
    }
    /// Confidence that a node is on the side on which it is in the guess, in [0,1]. A mark outside of the guess implies
    /// that the guess is too small there, up to the distance by which it misses the mark, so that only nodes outside
    /// are doubtful. A mark inside implies that the guess is too large.
    [[nodiscard]] double known(std::size_t n) const {
        const Miss& miss = *nearest_[n];
        if (miss.outside == is_inside(n)) return 1;
        const double deep = std::abs(double(distance_[n])) / miss.off;
        return std::clamp(std::max((double(freedom_[n]) - 1) / (kCommon.clear_ratio - 1), 2 * (deep - 1)), 0.0, 1.0);
    }
    /// Nodes at most one cell from a position.
    [[nodiscard]] std::vector<std::size_t> nodes_beside(const Vec3& place) const {
        std::vector<std::size_t> nodes;
        Index3 low, high;
        for (int a = 0; a < 3; ++a) {
            const double at = (place[a] - lattice_.origin[a]) / lattice_.spacing[a],
                         reach = lattice_.finest() / lattice_.spacing[a];
            const double last = lattice_.size[a] - 1;  // clamped because the position may lie outside the lattice
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
    [[nodiscard]] bool is_inside(std::size_t n) const { return guess_.inside[n] != 0; }
    [[nodiscard]] bool is_free(std::size_t n) const { return double(freedom_[n]) <= kCommon.clear_ratio; }
    void drop_loose_parts(std::vector<char>& body, bool of_inside) const;

    const RunContext& run_;
    const ImageGeometry& geometry_;
    std::vector<Miss> misses_;
    Lattice lattice_;
    Solid guess_;
    Field distance_;  // signed distance to the surface of guess_
    ImageFeatures image_;
    Field freedom_;                     // distance to the nearest missed mark, relative to its Miss::off
    std::vector<const Miss*> nearest_;  // the mark to which freedom_ refers
    std::vector<Sample> samples_;
    Field level_;  // level set of the redrawn surface
};

double Redrawing::learn() {
    constexpr std::size_t kOfEach = 600, kFewest = 100;
    const double cell = lattice_.finest();
    for (const bool inside : {true, false}) {
        std::vector<std::size_t> nodes;
        for (std::size_t n = 0; n < lattice_.count(); ++n) {
            const double deep = std::abs(double(distance_[n])) / cell;
            if (is_inside(n) == inside && deep > 1 && deep < 8 && !is_free(n)) nodes.push_back(n);
        }
        int fold = 0;
        for (const std::size_t n : some_of(nodes, kOfEach)) {
            Sample s;
            s.at = image_.at(n);
            s.inside = inside;
            s.fold = fold++ % kFolds;
            samples_.push_back(s);
        }
    }
    if (samples_.size() < kFewest) return 0;
    return held_out_bits(samples_, kFolds);
}

/// Assigns connected parts of one side (inside if `of_inside`, else outside) to the other side if they lie entirely in
/// the region that is redrawn.
void Redrawing::drop_loose_parts(std::vector<char>& body, bool of_inside) const {
    std::vector<char> side(body.size());
    for (std::size_t n = 0; n < body.size(); ++n) side[n] = (body[n] != 0) == of_inside ? 1 : 0;
    const Parts parts = label_parts(lattice_, side);
    std::vector<char> is_connected(std::size_t(parts.count) + 1, 0);
    for (std::size_t n = 0; n < body.size(); ++n)
        if (!is_free(n)) is_connected[std::size_t(parts.number[n])] = 1;
    for (std::size_t n = 0; n < body.size(); ++n)
        if (side[n] != 0 && is_connected[std::size_t(parts.number[n])] == 0) body[n] = of_inside ? 0 : 1;
}

void Redrawing::draw(const std::vector<Vec3>& inside, const std::vector<Vec3>& outside) {
    const Appearance appearance(samples_);
    const double maximum = kInference.max_odds, cell = lattice_.finest();
    Field cost(lattice_.count()), weight = image_.edge(lattice_, places_of(misses_)), u(lattice_.count());
    tbb::parallel_for(std::size_t(0), lattice_.count(), [&](std::size_t n) {
        const double sure = known(n), side = is_inside(n) ? maximum : -maximum;
        double odds = kKnown * side;
        if (sure < 1)
            odds = (1 - sure) * std::clamp(appearance.log_odds(image_.at(n)), -maximum, maximum) + sure * side;
        cost[n] = float(-kInference.odds_weight * odds);
        u[n] = odds > 0 ? 1.0F : 0.0F;
    });
    const auto hold = [&](const Vec3& place, double odds) {
        for (const std::size_t n : nodes_beside(place)) {
            cost[n] = float(-kInference.odds_weight * odds);
            weight[n] = 0;
        }
    };
    // The nodes between a missed mark and the surface of the guess are on the wrong side in the guess, and are held on
    // the other one.
    std::array<Field, 3> slope;
    for (int a = 0; a < 3; ++a) slope[std::size_t(a)] = derivative(lattice_, distance_, a);
    for (const Miss& miss : misses_) {
        Vec3 to_guess;
        for (int a = 0; a < 3; ++a)
            to_guess[a] = (miss.outside ? -1 : 1) * lattice_.value(slope[std::size_t(a)], miss.place);
        for (double way = 1.5 * cell; way < miss.off; way += 0.5 * cell)
            hold(plus(miss.place, way, unit(to_guess)), miss.outside ? maximum : -maximum);
    }
    for (const Vec3& world : inside) hold(to_frame(geometry_, world), kKnown * maximum);
    for (const Vec3& world : outside) hold(to_frame(geometry_, world), -kKnown * maximum);
    Solid body = solve_body(lattice_, weight, cost, std::move(u), run_);
    for (const bool of_inside : {true, false}) drop_loose_parts(body.inside, of_inside);
    level_ = body.level();
}

WorldBox Redrawing::box() const {
    const Index3& n = lattice_.size;
    std::vector<Vec3> world;
    for (const Vec3& corner : corners({lattice_.origin, lattice_.place(n[0] - 1, n[1] - 1, n[2] - 1)}))
        world.push_back(to_world(geometry_, corner));
    return bounding_box(world);
}

FloatGridPtr Redrawing::on(const FloatGrid& guess) const {
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
                if (nearest_miss(place).first > kCommon.clear_ratio) continue;
                accessor.setValueOn({i, j, k}, float(std::clamp(lattice_.value(level_, place), -clamp, clamp)));
            }
    return start_from_grid(domain, *result, run_);
}

}  // namespace

Redrawn redraw(const FloatGridPtr& guess, const std::vector<Vec3>& marks, const Image& image, const KnownSides& sides,
               const RunContext& run) {
    Redrawn result;
    result.u = guess;
    result.reason = "the guess passes through the marks";
    const ImageGeometry& geometry = image.geometry();
    const double voxel = geometry.smallest_spacing(),
                 widest = *std::max_element(geometry.spacing.begin(), geometry.spacing.end()),
                 missed = kInference.off_cells * std::max(voxel, 0.5 * widest),
                 clamp = kHalfWidthVoxels * guess->voxelSize()[0];
    std::vector<Miss> misses;
    const std::vector<double> levels = detail::levels_at(*guess, marks);
    for (std::size_t n = 0; n < marks.size(); ++n)
        if (std::abs(levels[n]) > std::min(missed, 0.9 * clamp))
            misses.push_back({to_frame(geometry, marks[n]), std::abs(levels[n]), levels[n] > 0});
    if (misses.empty()) return result;
    with_threads(run, [&] {
        // The guess is clamped, so that the distance by which a mark is missed has to be measured again.
        const Solid wide = solid_of(*guess, geometry, around(geometry, misses, kInference.farthest_miss * voxel));
        if (std::count(wide.inside.begin(), wide.inside.end(), wide.inside.front()) ==
            std::ptrdiff_t(wide.inside.size())) {
            result.reason = "no surface of the guess was found within " + detail::number(kInference.farthest_miss) +
                            " voxels of the marks that it misses";
            return;
        }
        const Field distance = signed_distance(wide.lattice, wide.inside);
        for (Miss& miss : misses) miss.off = std::max(std::abs(wide.lattice.value(distance, miss.place)), miss.off);
        std::erase_if(misses, [&](const Miss& miss) { return miss.off <= missed; });
        if (misses.empty()) return;
        double sum = 0, maximum = 0;
        for (const Miss& miss : misses) {
            sum += miss.off / double(misses.size());
            maximum = std::max(maximum, miss.off);
        }
        const Lattice lattice = around(geometry, misses, (kCommon.clear_ratio + 1) * maximum + kBeyondVoxels * voxel);
        if (is_too_large(lattice, geometry, run)) {
            result.reason = "the image's box around the marks that the guess misses is too large to be read as a whole";
            return;
        }
        Redrawing redrawing(*guess, image, misses, lattice, run);
        result.bits = redrawing.learn();
        if (result.bits < kInference.redraw_bits) {
            result.reason = "the image does not distinguish inside and outside of the guess";
            return;
        }
        redrawing.draw(sides.inside, sides.outside);
        if (!(redrawing.distance_to_marks() < sum)) {
            result.reason = "the surface that the image shows is not closer to the marks";
            return;
        }
        result.u = redrawing.on(*guess);
        result.box = redrawing.box();
        result.used = true;
        result.reason = "near marks that the guess misses";
    });
    return result;
}

}  // namespace covol
