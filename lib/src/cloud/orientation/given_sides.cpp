#include "cloud/orientation/given_sides.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "cloud/indicator/areas.h"
#include "cloud/indicator/heuristics.h"
#include "cloud/indicator/indicator.h"
#include "cloud/orientation/heuristics.h"
#include "cloud/orientation/judge.h"
#include "cloud/orientation/propagation.h"
#include "cloud/orientation/views.h"
#include "covol/error.h"
#include "points/heuristics.h"
#include "points/kd_tree.h"
#include "points/neighbours.h"

namespace covol {
namespace cloud {
namespace {

constexpr double kHalfwayInside = 0.75;  // indicator halfway between the border, 1/2, and the inside, 1

std::size_t count_known(const std::vector<Vec3>& directions) {
    return std::size_t(std::count_if(directions.begin(), directions.end(), [](const Vec3& d) {
        return d != Vec3{0, 0, 0};
    }));
}

/// Normals of local planes, on the side to which `towards` points; 0 for points at which `towards` is 0.
std::vector<Vec3> normals_towards(const std::vector<Vec3>& points, const std::vector<Vec3>& towards,
                                  const CloudScale& scale) {
    std::vector<Vec3> normals = plane_normals(points, scale);
    for (std::size_t n = 0; n < normals.size(); ++n)
        normals[n] = times(dot(normals[n], towards[n]) < 0 ? -1 : towards[n] == Vec3{0, 0, 0} ? 0 : 1, normals[n]);
    return normals;
}

/// Given normals, their cross-validation, and their correction by their indicator.
class HeldOutHints {
public:
    HeldOutHints(const std::vector<Vec3>& points, std::vector<Vec3> normals, const CloudScale& scale,
                 const RunContext& run)
        : points_(points),
          run_(run),
          areas_(areas_of(points, scale.spacing)),
          field_(indicator_grid(points, areas_, coarse_cell(scale))) {
        oriented_.normals = std::move(normals);
        oriented_.areas = areas_;
    }

    /// Fraction of the given normals whose sides are predicted by the indicator of the other half of the normals.
    /// Reverses all normals if they point inwards.
    /// @param is_outward  whether the normals are known to point outwards
    double predicted(HintsReport& report, bool is_outward) {
        std::vector<char> all(points_.size(), 1);
        compute_indicator(all);
        report.inward = !is_outward && mean_at(field_, points_) < 0;
        if (report.inward)
            for (Vec3& n : oriented_.normals) n = times(-1, n);
        std::size_t agree = 0;
        for (const bool half : {false, true}) {
            std::vector<char> selected(points_.size());
            for (std::size_t n = 0; n < selected.size(); ++n) selected[n] = is_second(n) == half;
            compute_indicator(selected);
            for (std::size_t n = 0; n < selected.size(); ++n) agree += !selected[n] && falls_along(n) > 0;
        }
        return double(agree) / double(std::max<std::size_t>(count_known(oriented_.normals), 1));
    }

    /// Reverses single normals that the indicator contradicts. A point without a normal receives the direction in which
    /// the indicator decreases.
    void resolve_contradictions() {
        for (int n = 0; n < kCloud.settling; ++n) {
            compute_indicator(std::vector<char>(points_.size(), 1));
            std::size_t turned = 0;
            for (std::size_t p = 0; p < points_.size(); ++p) {
                if (falls_along(p) * field_.indicator().stack().cell() > -kCommon.minority) continue;
                oriented_.normals[p] = times(-1, oriented_.normals[p]);
                ++turned;
            }
            if (turned == 0) break;
        }
        for (std::size_t p = 0; p < points_.size(); ++p)
            if (oriented_.normals[p] == Vec3{0, 0, 0})
                oriented_.normals[p] = unit(times(-1, field_.indicator().at(points_[p]).gradient));
    }

    [[nodiscard]] Orientation& oriented() { return oriented_; }

private:
    /// Whether a point belongs to the second half. The halves are pseudo-random instead of alternating, because the two
    /// points of a pair would always be in different halves if a file contains its points in pairs.
    static bool is_second(std::size_t n) { return (n * 2654435761U >> 16 & 1) != 0; }

    [[nodiscard]] double falls_along(std::size_t n) const {
        return -dot(oriented_.normals[n], field_.indicator().at(points_[n]).gradient);
    }

    /// Computes the indicator of the normals of the selected points.
    void compute_indicator(const std::vector<char>& selected) {
        std::vector<Vec3> vectors(points_.size());
        for (std::size_t n = 0; n < vectors.size(); ++n)
            vectors[n] = selected[n] ? times(oriented_.areas[n], oriented_.normals[n]) : Vec3{0, 0, 0};
        field_.solve(points_, vectors, kCyclesFromNothing, run_);
        scale_to_half(field_, points_);
    }

    const std::vector<Vec3>& points_;
    const RunContext& run_;
    std::vector<double> areas_;
    WindingField field_;
    Orientation oriented_;
};

/// Fraction of the points that have a neighbour on the same sheet, not above or below it, with an opposite normal, as
/// along the rim of a part whose normals are all reversed.
double torn(const std::vector<Vec3>& points, const std::vector<Vec3>& normals, double spacing) {
    const PointCells cells(points, kNear.first_radius * spacing);
    std::vector<char> is_torn(points.size(), 0);
    for_nearest(cells, spacing, kCommon.ring, [&](std::uint32_t point, const std::vector<Neighbour>& near) {
        for (const Neighbour& other : near) {
            const double up = dot(minus(cells.sorted()[other.at], points[point]), normals[point]);
            if (up * up < kCloud.flat * kCloud.flat * other.squared &&
                dot(normals[point], normals[cells.order()[other.at]]) < -kCommon.turn)
                is_torn[point] = 1;
        }
    });
    return double(std::count(is_torn.begin(), is_torn.end(), 1)) / double(points.size());
}

/// Computes the indicator of an orientation's normals, scaled to 1/2 at the points, and scales the areas by the same
/// factor.
void find_indicator(WindingField& field, const std::vector<Vec3>& points, Orientation& result, const RunContext& run) {
    solve(field, points, result, kCyclesFromNothing, run);
    const double half = scale_to_half(field, points);
    for (double& area : result.areas) area *= half;
    result.indicator = make_indicator(field);
    result.off_half = std::abs(mean_at(field, points) - 0.5);
}

/// Cross-validates the given normals, and computes the orientation from them unless they fail.
/// @param given  normals; 0 if unknown
/// @return whether they are used
bool use(const std::vector<Vec3>& points, const std::vector<Vec3>& given, bool is_outward, const CloudScale& scale,
         double cell, GivenSides& result, const RunContext& run) {
    result.given = given;
    HeldOutHints held_out(points, given, scale, run);
    result.report.predicted = held_out.predicted(result.report, is_outward);
    result.report.why_not.clear();
    if (result.report.predicted < kGivenSides.min_right) {
        result.report.why_not = "one half of them does not predict the sides of the other half";
        return false;
    }
    held_out.resolve_contradictions();
    Orientation& own = result.orientation = std::move(held_out.oriented());
    WindingField field(indicator_grid(points, own.areas, cell));
    find_indicator(field, points, own, run);
    result.torn = torn(points, own.normals, scale.spacing);
    own.turned = 1 - agreeing(points, own.normals, own, false);
    // Points that noise has moved across a thin part have normals of the opposite side; all normals are then replaced
    // by those of the indicator.
    for (int n = 0; own.turned > kCloud.few && n < kGivenSides.smoothings; ++n) {
        for (std::size_t p = 0; p < points.size(); ++p)
            own.normals[p] = unit(times(-1, own.indicator->at(points[p]).gradient));
        if (n + 1 < kGivenSides.smoothings) find_indicator(field, points, own, run);
    }
    result.report.used = true;
    return true;
}

}  // namespace

std::vector<char> find_enclosed(const std::vector<Vec3>& points, const std::vector<Vec3>& normals,
                                const Indicator& indicator, const CloudScale& scale, double reach) {
    std::vector<char> alone(points.size()), enclosed(points.size());
    tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) {
        if (normals[n] == Vec3{0, 0, 0}) return;  // the two sides of the point are not known
        const Vec3 away = times(reach, normals[n]);
        alone[n] = std::min({indicator.inside(points[n]), indicator.inside(plus(points[n], away)),
                             indicator.inside(minus(points[n], away))}) > kHalfwayInside;
    });
    // Noise moves single points into the solid, whereas the points of a wall inside it are next to each other. A point
    // therefore counts as enclosed only if most of its neighbours are inside as well.
    const PointCells cells(points, kNear.first_radius * scale.spacing);
    for_nearest(cells, scale.spacing, kCommon.ring, [&](std::uint32_t point, const std::vector<Neighbour>& near) {
        const auto others = std::count_if(near.begin(), near.end(),
                                          [&](const Neighbour& other) { return alone[cells.order()[other.at]] != 0; });
        enclosed[point] = alone[point] != 0 && 2 * std::size_t(others) > near.size();
    });
    return enclosed;
}

double agreeing(const std::vector<Vec3>& points, const std::vector<Vec3>& given, const Orientation& orientation,
                bool turned_over) {
    if (given.empty()) return 0;
    std::vector<char> agrees(points.size());
    tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) {
        agrees[n] = (dot(given[n], orientation.indicator->at(points[n]).gradient) < 0) != turned_over &&
                    given[n] != Vec3{0, 0, 0};
    });
    return double(std::count(agrees.begin(), agrees.end(), 1)) / double(std::max<std::size_t>(count_known(given), 1));
}

GivenSides given_sides(const std::vector<Vec3>& points, const PointHints& hints, const CloudScale& scale, double cell,
                       const RunContext& run) {
    GivenSides result;
    if (points.size() < 4 || !(scale.spacing > 0)) return result;
    result.report.normals = count_known(hints.normals);
    result.report.sensors = count_known(hints.to_sensor);
    const double minimum = 0.5 * double(points.size());  // hints of fewer points are not used
    if (double(result.report.normals) >= minimum && result.report.normals > 0 &&
        use(points, hints.normals, hints.is_outward, scale, cell, result, run))
        return result;
    run.check();
    if (double(result.report.sensors) < minimum || result.report.sensors == 0) return result;
    if (fraction_free(points, hints.to_sensor, scale) < kGivenSides.min_right) {
        if (result.report.normals == 0) result.report.why_not = "most points are not visible from the sensor";
        return result;
    }
    result.report.from_sensor =
        use(points, normals_towards(points, hints.to_sensor, scale), hints.is_outward, scale, cell, result, run);
    return result;
}

}  // namespace cloud

PointHints carried(const PointHints& hints, const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
    for (const auto* list : {&hints.normals, &hints.to_sensor})
        if (!list->empty() && list->size() != from.size())
            throw Error(Errc::InvalidInput, "expected a normal or a direction to the sensor for each of " +
                                                std::to_string(from.size()) + " points, got " +
                                                std::to_string(list->size()));
    if (hints.normals.empty() && hints.to_sensor.empty()) return {};
    std::vector<std::pair<Vec3, std::size_t>> places;
    places.reserve(from.size());
    for (std::size_t n = 0; n < from.size(); ++n) places.emplace_back(from[n], n);
    std::sort(places.begin(), places.end());
    const detail::KdTree tree(from);
    PointHints result;
    result.is_outward = hints.is_outward;
    for (const Vec3& p : to) {
        const Vec3 nearest = tree.nearest_point(p);
        const std::size_t n =
            std::lower_bound(places.begin(), places.end(), std::pair{nearest, std::size_t(0)})->second;
        if (!hints.normals.empty()) result.normals.push_back(hints.normals[n]);
        if (!hints.to_sensor.empty()) result.to_sensor.push_back(hints.to_sensor[n]);
    }
    return result;
}

}  // namespace covol
