#include "cloud/indicator/indicator.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "base/median.h"
#include "cloud/indicator/heuristics.h"
#include "covol/points.h"
#include "points/point_cells.h"

namespace covol {

struct Indicator::Values {
    cloud::StackField field;
};

Indicator::Indicator(std::unique_ptr<const Values> values) : values_(std::move(values)) {}
Indicator::~Indicator() = default;

double Indicator::inside(const Vec3& world) const { return values_->field.value_at(world); }
Indicator::Sample Indicator::at(const Vec3& world) const {
    const cloud::StackField::Sample sample = values_->field.at(world);
    return {sample.value, sample.gradient, sample.cell};
}
double Indicator::cell() const { return values_->field.stack().cell(); }

void Indicator::crossed(const std::function<void(const WorldBox&)>& visit) const {
    const cloud::GridStack& stack = values_->field.stack();
    for (std::size_t l = 0; l < stack.levels().size(); ++l) {
        const cloud::GridLevel& level = stack.levels()[l];
        const std::vector<float>& values = values_->field.values[l];
        for (std::uint32_t block = 0; block < level.blocks.size(); ++block)
            for (int n = 0; n < int(cloud::kBlockNodes); ++n) {
                const int i = n >> 6, j = n >> 3 & 7, k = n & 7;
                int inside = 0, known = 0;
                for (int corner = 0; corner < 8; ++corner) {
                    const int x = i + (corner >> 2), y = j + (corner >> 1 & 1), z = k + (corner & 1);
                    const std::uint32_t at =
                        level.beside[block][std::size_t(((x >> 3) + 1) * 9 + ((y >> 3) + 1) * 3 + (z >> 3) + 1)];
                    if (at == cloud::kNoBlock) break;
                    ++known;
                    inside +=
                        values[at * cloud::kBlockNodes + std::size_t((x & 7) * 64 + (y & 7) * 8 + (z & 7))] > 0.5F;
                }
                if (known < 8 || inside == 0 || inside == 8 || stack.is_refined(l, block, i, j, k)) continue;
                const cloud::BlockAt& at = level.blocks[block];
                const Vec3& o = stack.origin();
                const Vec3 low{o[0] + (8.0 * at[0] + i) * level.cell, o[1] + (8.0 * at[1] + j) * level.cell,
                               o[2] + (8.0 * at[2] + k) * level.cell};
                visit({low, {low[0] + level.cell, low[1] + level.cell, low[2] + level.cell}});
            }
    }
}

namespace cloud {

double indicator_side(double longest) { return longest * (1 + 2 * kCommon.margin); }

double indicator_cell(const std::vector<Vec3>& points, double cell) {
    return std::min(cell, indicator_side(longest_side(bounding_box(points))) / kIndicator.min_cells);
}

std::shared_ptr<const GridStack> indicator_grid(const std::vector<Vec3>& points, const std::vector<double>& areas,
                                                double cell) {
    return grid_around(points, areas, indicator_cell(points, cell));
}

std::shared_ptr<const GridStack> grid_around(const std::vector<Vec3>& points, const std::vector<double>& areas,
                                             double cell) {
    std::vector<std::uint8_t> levels(areas.size());
    for (std::size_t n = 0; n < areas.size(); ++n)
        levels[n] = std::uint8_t(
            std::clamp(std::floor(std::log2(kIndicator.local_cells * std::sqrt(areas[n]) / cell)), 0.0, 31.0));
    return std::make_shared<const GridStack>(points, levels, cell, kCommon.margin);
}

double scale_to_half(WindingField& field, const std::vector<Vec3>& points) {
    std::vector<double> values(points.size());
    tbb::parallel_for(std::size_t(0), points.size(),
                      [&](std::size_t n) { values[n] = std::abs(field.indicator().value_at(points[n])); });
    const double half = median(std::move(values));
    if (!(half > 0)) return 1;
    field.multiply(0.5 / half);
    return 0.5 / half;
}

double mean_at(const WindingField& field, const std::vector<Vec3>& points) {
    std::vector<double> values(points.size());
    tbb::parallel_for(std::size_t(0), points.size(),
                      [&](std::size_t n) { values[n] = field.indicator().value_at(points[n]); });
    return std::accumulate(values.begin(), values.end(), 0.0) / double(points.size());
}

double bare_fraction(const Indicator& indicator, const std::vector<Vec3>& points, double reach) {
    const PointCells cells(points, reach);
    double all = 0, bare = 0;
    indicator.crossed([&](const WorldBox& box) {
        const double side = box.max[0] - box.min[0], area = side * side;
        all += area;
        if (!cells.any_within(times(0.5, plus(box.min, box.max)), reach)) bare += area;
    });
    return all > 0 ? bare / all : 1;
}

std::shared_ptr<const Indicator> make_indicator(StackField field) {
    return std::make_shared<const Indicator>(
        std::make_unique<const Indicator::Values>(Indicator::Values{std::move(field)}));
}

std::shared_ptr<const Indicator> make_indicator(const WindingField& field) { return make_indicator(field.indicator()); }

void solve(WindingField& field, const std::vector<Vec3>& points, const Orientation& orientation, int cycles,
           const RunContext& run) {
    std::vector<Vec3> vectors(points.size());
    tbb::parallel_for(std::size_t(0), points.size(),
                      [&](std::size_t n) { vectors[n] = times(orientation.areas[n], orientation.normals[n]); });
    field.solve(points, vectors, cycles, run);
}

std::shared_ptr<const Indicator> indicator_of(const std::vector<Vec3>& points, const Orientation& orientation,
                                              double cell, const RunContext& run) {
    WindingField field(indicator_grid(points, orientation.areas, cell));
    solve(field, points, orientation, kCyclesFromNothing, run);
    scale_to_half(field, points);
    return make_indicator(field);
}

}  // namespace cloud
}  // namespace covol
