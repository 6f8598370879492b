#include "cloud/orientation/filled.h"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "base/median.h"
#include "cloud/indicator/heuristics.h"
#include "cloud/indicator/indicator.h"
#include "cloud/indicator/iteration.h"
#include "cloud/orientation/heuristics.h"
#include "points/point_cells.h"

namespace covol::cloud {
namespace {

constexpr int kMaxRadii = 64;

struct Neighbourhood {
    double count = 0;
    double thickness = 0;  ///< [radii] minimum standard deviation along any direction
};

Neighbourhood spread_around(const PointCells& cells, const Vec3& at, double radius) {
    std::vector<PointCells::Range> ranges;
    cells.find(at, radius, ranges);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    double count = 0;
    for (const PointCells::Range& range : ranges)
        for (std::uint32_t n = range.begin; n < range.end; ++n) {
            const Vec3 to = minus(cells.sorted()[n], at);
            const Eigen::Vector3d v = Eigen::Vector3d(to[0], to[1], to[2]) / radius;
            if (v.squaredNorm() > 1) continue;
            ++count;
            sum += v;
            squares += v * v.transpose();
        }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares / count - sum * sum.transpose() / (count * count),
                                                              Eigen::EigenvaluesOnly);
    return {count, std::sqrt(std::max(0.0, axes.eigenvalues()[0]))};
}

/// [radii] Expected thickness, as in Neighbourhood, of `count` random points that fill a ball. The formula was fitted
/// to balls of 8 to 100 points such that few of them have a smaller thickness.
double expected_thickness(double count) { return std::sqrt(0.2) * (1 - 1.25 / std::sqrt(count)); }

}  // namespace

bool fill_a_solid(const std::vector<Vec3>& points, double spacing, const RunContext& run) {
    const auto all = double(points.size());
    // Neighbourhoods of kCommon.ring points to an eighth of all points are tested. With fewer points, these two numbers
    // would not differ by a factor of 12.
    if (all < 96 * double(kCommon.ring) || !(spacing > 0)) return false;
    const PointCells cells(points, spacing);
    std::vector<Neighbourhood> around(std::min(points.size(), kCommon.sample));
    // The sampled points are not at regular intervals of the sorted points: if the points form rows, these might all be
    // at the same position in their rows.
    const auto at = [&](std::size_t m) { return cells.sorted()[m * 2654435761U % points.size()]; };
    double radius = spacing;
    for (int n = 0; n < kMaxRadii; ++n, radius *= kCommon.growth) {
        run.check();
        tbb::parallel_for(std::size_t(0), around.size(),
                          [&](std::size_t m) { around[m] = spread_around(cells, at(m), radius); });
        const auto median_of = [&](auto value) {
            std::vector<double> values(around.size());
            std::transform(around.begin(), around.end(), values.begin(), value);
            return median(std::move(values));
        };
        const double count = median_of([](const Neighbourhood& a) { return a.count; });
        if (count < double(kCommon.ring)) continue;
        if (count > all / 8) return true;
        const double thickness = median_of([](const Neighbourhood& a) { return a.thickness; });
        if (thickness < std::min(kFilled.min_thickness, kFilled.thick * expected_thickness(count))) return false;
    }
    return false;
}

Orientation orient_filled(const std::vector<Vec3>& points, const CloudScale& scale) {
    // A ball of radius near_reach around a point contains eleven others; `spacing` cubed is the volume per point.
    const double spacing = scale.near_reach * std::cbrt(4 * M_PI / 3 / 11);
    StackField density =
        spread(grid_around(points, {}, kCloud.coarse * spacing), points, std::vector<double>(points.size(), 1.0));
    std::vector<double> values(points.size());
    tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) { values[n] = density.value_at(points[n]); });
    const double within = median(std::move(values));
    for (std::vector<float>& level : density.values)
        for (float& value : level) value = float(double(value) / within);
    Orientation result;
    result.indicator = result.screened = make_indicator(std::move(density));
    result.normals = normals_of(*result.indicator, points, std::numeric_limits<double>::infinity());
    result.areas.assign(points.size(), spacing * spacing);
    return result;
}

}  // namespace covol::cloud
