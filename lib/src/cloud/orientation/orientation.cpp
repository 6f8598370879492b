#include "covol/orientation.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

#include "base/heuristics.h"
#include "cloud/indicator/areas.h"
#include "cloud/indicator/consistency.h"
#include "cloud/indicator/heuristics.h"
#include "cloud/indicator/indicator.h"
#include "cloud/indicator/iteration.h"
#include "cloud/indicator/torn.h"
#include "cloud/orientation/attempts.h"
#include "cloud/orientation/heuristics.h"
#include "cloud/orientation/judge.h"
#include "cloud/orientation/propagation.h"
#include "covol/error.h"
#include "covol/points.h"
#include "points/point_cells.h"

namespace covol {
namespace {

using cloud::first_cell;
using cloud::is_settled;
using cloud::Iteration;
using cloud::normals_of;
using cloud::Stage;

/// Parameters of an attempt. No further attempt is made after one that is settled and has at least the cell size of the
/// first attempt.
struct Attempt {
    double cell;         // cell size relative to first_cell()
    double enclosed;     // Stage::enclosed of the first stage
    bool is_propagated;  // initial normals: propagated_normals(); false: from the density of the points
};

/// A spatially even subset of the points, with the area of the surface that each represents.
struct Sample {
    Sample(const std::vector<Vec3>& all, double spacing, std::size_t every)
        : step(every), order(cloud::PointCells(all, kCloud.coarse * spacing).order()) {
        for (std::size_t n = step / 2; n < order.size(); n += step) points.push_back(all[order[n]]);
        areas = cloud::areas_of(points, spacing * std::sqrt(double(step)));
    }
    /// The areas of all points: the area of each point of the sample is divided among the points that it represents.
    [[nodiscard]] std::vector<double> all_areas() const {
        std::vector<double> all(order.size());
        for (std::size_t n = 0; n < order.size(); ++n)
            all[order[n]] = areas[std::min(n / step, areas.size() - 1)] / double(step);
        return all;
    }
    std::size_t step;
    std::vector<std::uint32_t> order;
    std::vector<Vec3> points;
    std::vector<double> areas;
};
struct AttemptResult {
    Orientation orientation;
    std::vector<Vec3> normals;  // of all points
    std::vector<double> off;    // Consistency::off()
    double mean_off = 0;
};

/// The most consistent attempt, with the normals of other attempts in patches in which these are more consistent.
Orientation best_of(std::vector<AttemptResult> tried, const std::vector<Vec3>& points, const Sample& sample,
                    cloud::Consistency& consistency, const RunContext& run) {
    std::stable_sort(tried.begin(), tried.end(),
                     [](const AttemptResult& a, const AttemptResult& b) { return a.mean_off < b.mean_off; });
    AttemptResult& first = tried.front();
    for (std::size_t n = 1; n < tried.size(); ++n) consistency.take_better(tried[n].normals, first.normals, first.off);
    Orientation best = std::move(first.orientation), whole;
    whole.normals = std::move(first.normals);
    whole.areas = sample.all_areas();
    best.indicator = cloud::indicator_of(points, whole, best.indicator->cell(), run);
    best.normals = std::move(whole.normals);
    return best;
}

}  // namespace

namespace cloud {

Orientation try_orientations(const std::vector<Vec3>& points, const CloudScale& scale, double part,
                             const RunContext& run) {
    if (points.size() < 4)
        throw Error(Errc::InvalidInput, "points: expected at least 4, got " + std::to_string(points.size()));
    if (!(longest_side(bounding_box(points)) > 0) || !(scale.spacing > 0))
        throw Error(Errc::InvalidInput, "points: expected different positions, got the same one for all points");
    // If normals keep changing their sides, the cause may be noise or thin parts, which are hard to distinguish.
    // Therefore attempts with smaller cells follow, which may resolve thin parts.
    const double first = first_cell(scale, part, points.size());
    // Parts thinner than the first cells require cells as small as the points allow.
    const double finest = finest_cell(scale, points.size()), cell = indicator_cell(points, finest);
    // The iteration uses as many points as are needed to determine the indicator: several in each cell that the
    // surface crosses.
    const double cells = kCloud.coarse * scale.spacing / cell;
    const double fraction = std::min(cells * cells, kOrientation.max_sampled / double(points.size()));
    const double maximum = std::max(1.0, double(points.size() / kCommon.sample));
    const Sample sample(points, scale.spacing, std::size_t(std::clamp(1 / fraction, 1.0, maximum)));
    const double reach = miss_reach(scale);
    std::optional<Consistency> consistency;
    std::vector<std::tuple<double, double, bool>> lattices;
    std::vector<AttemptResult> tried;
    // The cells are at least as wide as the noise, and may thus be wider than thin walls. Therefore some attempts
    // have smaller cells.
    std::vector<Attempt> attempts{{1, kOrientation.enclosed, true},
                                  {1, kOrientation.surely_enclosed, false},
                                  {1 / kCommon.growth, kOrientation.surely_enclosed, true},
                                  {1 / (kCommon.growth * kCommon.growth), kOrientation.enclosed, false}};
    if (first > kCommon.growth * finest) attempts.push_back({finest / first, kOrientation.surely_enclosed, true});
    const auto evaluated = [&](Orientation orientation, std::vector<Vec3> normals) {
        std::vector<double> off = consistency->off(normals);
        const double mean_off = std::accumulate(off.begin(), off.end(), 0.0) / double(off.size());
        return AttemptResult{std::move(orientation), std::move(normals), std::move(off), mean_off};
    };
    const std::vector<Vec3> propagated =
        propagated_normals(sample.points, scale, scale.spacing * std::sqrt(double(sample.step)));
    for (const Attempt& attempt : attempts) {
        const double tried_cell = indicator_cell(points, first * attempt.cell);
        const std::tuple lattice{tried_cell, attempt.enclosed, attempt.is_propagated};
        if (std::count(lattices.begin(), lattices.end(), lattice) > 0) continue;
        lattices.push_back(lattice);
        Orientation now;
        now.areas = sample.areas;
        if (attempt.is_propagated) now.normals = propagated;
        Iteration iteration(sample.points, sample.areas, run);
        for (const Stage& stage : {Stage{1.5 * tried_cell, 12, false, attempt.enclosed},
                                   Stage{tried_cell, 8, true, kOrientation.surely_enclosed}})
            iteration.run(stage, now);
        if (is_clean(scale)) iteration.mend(scale.spacing * std::sqrt(double(sample.step)), now);
        now.indicator = make_indicator(iteration.last());
        now.off_half = std::abs(mean_at(iteration.last(), sample.points) - 0.5);
        std::vector<Vec3> normals = normals_of(*now.indicator, points, kOrientation.surely_enclosed);
        if (is_settled(now) && attempt.cell >= 1) {
            tried.clear();
            tried.push_back({std::move(now), std::move(normals), {}});
            break;
        }
        if (!consistency) {
            consistency.emplace(points, sample.all_areas(), finest / kCommon.growth, reach, run);
            // Iterations may reverse initially correct normals near thin parts, so the propagated normals are
            // compared as well.
            tried.push_back(evaluated(now, propagated_normals(points, scale, scale.spacing)));
        }
        tried.push_back(evaluated(std::move(now), std::move(normals)));
    }
    Orientation best;
    if (consistency && tried.size() > 1) {
        best = best_of(std::move(tried), points, sample, *consistency, run);
    } else {
        best = std::move(tried.front().orientation);
        best.normals = std::move(tried.front().normals);
    }
    const double half = std::accumulate(best.areas.begin(), best.areas.end(), 0.0) /
                        std::accumulate(sample.areas.begin(), sample.areas.end(), 0.0);
    best.areas = sample.all_areas();
    for (double& area : best.areas) area *= half;
    if (best.mended > 0) best.mended = repair_torn(points, scale.spacing, best.normals);
    return best;
}

}  // namespace cloud

Orientation orient(const std::vector<Vec3>& points, const CloudScale& scale, const RunContext& run) {
    Orientation result;
    with_threads(run, [&] { result = cloud::try_orientations(points, scale, cloud::part_side(points, scale), run); });
    return result;
}

}  // namespace covol
