#include "inference/marks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/geometry.h"
#include "base/median.h"
#include "covol/guess.h"
#include "guess/marks_surface.h"
#include "inference/heuristics.h"
#include "points/kd_tree.h"

namespace covol::inference {

Marks::Marks(const ImageGeometry& geometry, const std::vector<Vec3>& world) {
    for (const Vec3& mark : world) places.push_back(to_frame(geometry, mark));
    arrange(geometry);
}

Marks::Marks(std::vector<Vec3> marks, std::vector<Vec3> known_inside, std::vector<Vec3> known_outside,
             const ImageGeometry& geometry)
    : places(std::move(marks)), inside(std::move(known_inside)), outside(std::move(known_outside)) {
    arrange(geometry);
}

void Marks::arrange(const ImageGeometry& geometry) {
    std::sort(places.begin(), places.end());
    places.erase(std::unique(places.begin(), places.end()), places.end());
    Vec3 middle{0, 0, 0};
    for (const Vec3& mark : places) middle = plus(middle, 1.0 / double(places.size()), mark);
    std::stable_sort(places.begin(), places.end(), [&](const Vec3& a, const Vec3& b) {
        return detail::squared_distance(a, middle) < detail::squared_distance(b, middle);
    });
    const detail::KdTree tree(places);
    std::vector<double> apart;
    for (const Vec3& mark : places) apart.push_back(std::sqrt(tree.nearest_other(mark)));
    if (places.size() > 1) spacing = cloud::median(apart);
    for (const double s : geometry.spacing) variance += kUniformDeviation * kUniformDeviation * s * s / 3;
    choose_spread();
    make_hull(geometry);
}

Marks Marks::without(int fold, const ImageGeometry& geometry, std::vector<std::size_t>& rest,
                     std::vector<std::size_t>& left_out) const {
    Marks part;
    part.spacing = spacing;
    part.variance = variance;
    part.inside = inside;
    part.outside = outside;
    for (std::size_t n = 0; n < places.size(); ++n) {
        if (int(n % kFolds) == fold) {
            left_out.push_back(n);
        } else {
            rest.push_back(n);
            part.places.push_back(places[n]);
        }
    }
    part.choose_spread();
    part.make_hull(geometry);
    return part;
}

Marks Marks::without(const std::vector<Vec3>& left_out, const ImageGeometry& geometry) const {
    std::vector<Vec3> rest;
    for (const Vec3& mark : places)
        if (std::find(left_out.begin(), left_out.end(), mark) == left_out.end()) rest.push_back(mark);
    return {std::move(rest), inside, outside, geometry};
}

double Marks::above_hull(const Vec3& place) const {
    double maximum = -std::numeric_limits<double>::infinity();
    for (const auto& [direction, offset] : hull) maximum = std::max(maximum, dot(direction, place) - offset);
    return maximum;
}

void Marks::choose_spread() {
    spread = guess::spread_out(places, kInference.guess_marks, places.size() - 1);
    std::sort(spread.begin(), spread.end());
}

void Marks::make_hull(const ImageGeometry& geometry) {
    constexpr int kDirections = 200;
    // If marks are close to an end of the image, half-spaces are dropped whose normal has at least this cosine with the
    // direction of the axis towards this end.
    constexpr double kTowards = 0.3;
    for (int n = 0; n < kDirections; ++n) {  // directions of a Fibonacci lattice
        const double z = 1 - (2 * n + 1) / double(kDirections), phi = n * 2.399963229728653, r = std::sqrt(1 - z * z);
        const Vec3 direction{r * std::cos(phi), r * std::sin(phi), z};
        double offset = -std::numeric_limits<double>::infinity();
        for (const Vec3& mark : places) offset = std::max(offset, dot(direction, mark));
        hull.emplace_back(direction, offset);
    }
    for (int a = 0; a < 3; ++a)
        for (const bool upper : {false, true}) {
            const double end = (upper ? geometry.size[a] - 0.5 : -0.5) * geometry.spacing[a];
            const bool reaches_end = std::any_of(places.begin(), places.end(),
                                                 [&](const Vec3& mark) { return std::abs(end - mark[a]) <= spacing; });
            if (!reaches_end) continue;
            std::erase_if(hull, [&](const auto& face) { return (upper ? 1 : -1) * face.first[a] > kTowards; });
        }
}

}  // namespace covol::inference
