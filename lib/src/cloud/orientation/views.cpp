#include "cloud/orientation/views.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "cloud/indicator/areas.h"
#include "cloud/indicator/heuristics.h"
#include "cloud/indicator/indicator.h"
#include "cloud/orientation/heuristics.h"
#include "cloud/orientation/judge.h"
#include "cloud/orientation/layers.h"
#include "covol/points.h"
#include "points/point_cells.h"

namespace covol::cloud {
namespace {

constexpr int kRays = 96;  // from each cell; half and twice as many changed no result of small scans

/// Directions distributed evenly over the sphere: a Fibonacci spiral.
std::vector<Vec3> directions() {
    std::vector<Vec3> all;
    const double golden = M_PI * (3 - std::sqrt(5.0));
    for (int n = 0; n < kRays; ++n) {
        const double z = 1 - (2 * n + 1.0) / kRays, r = std::sqrt(1 - z * z);
        all.push_back({r * std::cos(golden * n), r * std::sin(golden * n), z});
    }
    return all;
}

/// The results of free_directions(), scaled to length 1; 0 where nearly as many directions are free on one side of the
/// point as on the other.
std::vector<Vec3> normalized_or_zero(std::vector<Vec3> free) {
    for (Vec3& way : free) way = std::sqrt(dot(way, way)) > kCommon.negligible ? unit(way) : Vec3{0, 0, 0};
    return free;
}

/// A dense mask of the cells with points.
class Occupied {
public:
    Occupied(const std::vector<Vec3>& points, double cell)
        : box_(bounding_box(points)), cell_(std::max(cell, longest_side(box_) / kViews.max_view_cells)) {
        std::size_t all = 1;
        for (std::size_t a = 0; a < 3; ++a) {
            count_[a] = std::ptrdiff_t((box_.max[int(a)] - box_.min[int(a)]) / cell_) + 1;
            all *= std::size_t(count_[a]);
        }
        full_.resize(all);
        for (const Vec3& p : points) full_[std::size_t(index(p))] = 1;
    }

    [[nodiscard]] double cell() const { return cell_; }

    /// Whether no cell with points lies in the direction. The ray begins beyond the sheet on which `from` lies.
    [[nodiscard]] bool is_free(const Vec3& from, const Vec3& direction) const {
        for (double t = kCloud.coarse;; ++t) {
            const std::ptrdiff_t at = index({from[0] + t * cell_ * direction[0], from[1] + t * cell_ * direction[1],
                                             from[2] + t * cell_ * direction[2]});
            if (at < 0) return true;
            if (full_[std::size_t(at)]) return false;
        }
    }

private:
    /// Index of the cell that contains a position; negative outside the box.
    [[nodiscard]] std::ptrdiff_t index(const Vec3& at) const {
        std::ptrdiff_t n = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            const double x = (at[int(a)] - box_.min[int(a)]) / cell_;
            if (x < 0 || x >= double(count_[a])) return -1;
            n = n * count_[a] + std::ptrdiff_t(x);
        }
        return n;
    }

    WorldBox box_;
    double cell_;
    std::array<std::ptrdiff_t, 3> count_{};
    std::vector<std::uint8_t> full_;
};

Vec3 middle_of(const PointCells& cells, std::size_t cell) {
    const auto [begin, end] = cells.cell(cell);
    Vec3 middle{0, 0, 0};
    for (std::uint32_t at = begin; at < end; ++at) middle = plus(middle, 1.0 / double(end - begin), cells.sorted()[at]);
    return middle;
}

}  // namespace

std::vector<Vec3> free_directions(const std::vector<Vec3>& points, double cell) {
    const Occupied occupied(points, cell);
    const PointCells cells(points, occupied.cell());
    const std::vector<Vec3> rays = directions();
    std::vector<Vec3> free(points.size());
    tbb::parallel_for(std::size_t(0), cells.cell_count(), [&](std::size_t c) {
        const Vec3 from = middle_of(cells, c);
        Vec3 sum{0, 0, 0};
        for (const Vec3& ray : rays)
            if (occupied.is_free(from, ray))
                for (int a = 0; a < 3; ++a) sum[a] += ray[a] / kRays;
        const auto [begin, end] = cells.cell(c);
        for (std::uint32_t at = begin; at < end; ++at) free[cells.order()[at]] = sum;
    });
    return free;
}

std::vector<Vec3> towards_sky(const std::vector<Vec3>& points, const CloudScale& scale) {
    const double cell = coarse_cell(scale);
    const Occupied occupied(points, cell);
    const PointCells cells(points, occupied.cell());
    const std::vector<Vec3> rays = directions();
    // For each ray, the number of points with a free view along it minus that of points with a free view against it.
    std::vector<double> seen(rays.size());
    tbb::parallel_for(std::size_t(0), rays.size(), [&](std::size_t r) {
        for (std::size_t c = 0; c < cells.cell_count(); ++c) {
            const auto [begin, end] = cells.cell(c);
            const Vec3 from = middle_of(cells, c);
            seen[r] +=
                double(end - begin) * (occupied.is_free(from, rays[r]) - occupied.is_free(from, times(-1, rays[r])));
        }
    });
    // In a scan with a common direction of view, which is called the sky here, more points are seen from there than
    // from the opposite side.
    Vec3 sky{0, 0, 0};
    if (*std::max_element(seen.begin(), seen.end()) > kCommon.negligible * double(points.size())) {
        for (std::size_t r = 0; r < rays.size(); ++r) sky = plus(sky, times(seen[r], rays[r]));
        sky = unit(sky);
    }
    std::vector<Vec3> all = normalized_or_zero(free_directions(points, cell));
    for (Vec3& way : all) way = plus(sky, times(kCommon.minority, way));
    return all;
}

double fraction_free(const std::vector<Vec3>& points, const std::vector<Vec3>& directions, const CloudScale& scale) {
    const Occupied occupied(points, coarse_cell(scale));
    std::vector<char> free(points.size());
    tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) {
        free[n] = directions[n] != Vec3{0, 0, 0} && occupied.is_free(points[n], directions[n]);
    });
    const auto known = std::count_if(directions.begin(), directions.end(), [](const Vec3& d) {
        return d != Vec3{0, 0, 0};
    });
    return double(std::count(free.begin(), free.end(), 1)) / double(std::max<std::ptrdiff_t>(known, 1));
}

void add_screened(const std::vector<Vec3>& points, const CloudScale& scale, const std::vector<char>& is_free,
                  const StackField* start, Orientation& result, const RunContext& run) {
    WindingField fine(indicator_grid(points, result.areas, 0.5 * coarse_cell(scale)));
    const double cell = fine.indicator().stack().cell();
    // A view determines only the side of a normal; its direction is taken from the indicator's gradient.
    std::vector<double> screen(points.size());
    std::size_t against = 0;
    for (std::size_t n = 0; n < points.size(); ++n) {
        const Vec3 falling = unit(times(-1, result.indicator->at(points[n]).gradient));
        const bool agrees = dot(falling, result.normals[n]) > 0;
        against += !agrees;
        if (agrees) result.normals[n] = falling;
        screen[n] = agrees && (is_free.empty() || !is_free[n]) ? kViews.screening * result.areas[n] / (cell * cell) : 0;
    }
    result.turned = double(against) / double(points.size());
    if (start != nullptr) fine.start_from(*start);
    fine.screen(points, screen);
    solve(fine, points, result, kCyclesFromNothing, run);
    result.screened = make_indicator(fine);
}

Orientation orient_by_views(const std::vector<Vec3>& points, const CloudScale& scale, const RunContext& run) {
    Orientation result;
    const double cell = coarse_cell(scale);
    const std::vector<Vec3> free = free_directions(points, cell);
    run.check();
    result.areas = areas_of(points, scale.spacing);
    result.normals = normalized_or_zero(free);
    WindingField coarse(indicator_grid(points, result.areas, cell));
    solve(coarse, points, result, kCyclesFromNothing, run);
    const double half = scale_to_half(coarse, points);
    for (double& area : result.areas) area *= half;
    const std::vector<char> turned = turn_layers(coarse, points, free, apart(scale), result, run);
    result.layered = std::size_t(std::count(turned.begin(), turned.end(), 1));
    result.indicator = make_indicator(coarse);
    run.check();
    add_screened(points, scale, turned, &coarse.indicator(), result, run);
    return result;
}

}  // namespace covol::cloud
