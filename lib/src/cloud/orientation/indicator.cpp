#include "cloud/orientation/indicator.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/geometry.h"
#include "base/median.h"
#include "cloud/orientation/heuristics.h"
#include "covol/points.h"
#include "points/point_cells.h"

namespace covol {

struct Indicator::Values {
    cloud::LatticeField field;
};

Indicator::Indicator(std::unique_ptr<const Values> values) : values_(std::move(values)) {}
Indicator::~Indicator() = default;

double Indicator::inside(const Vec3& world) const { return values_->field.value_at(world); }
Indicator::Sample Indicator::at(const Vec3& world) const {
    const cloud::LatticeField::Sample sample = values_->field.at(world);
    return {sample.value, sample.gradient};
}
double Indicator::cell() const { return values_->field.lattice.cell; }

void Indicator::crossed(const std::function<void(const WorldBox&)>& visit) const {
    const cloud::Lattice& l = values_->field.lattice;
    const std::vector<float>& values = values_->field.values;
    const std::size_t up_i = std::size_t(l.nodes[1]) * std::size_t(l.nodes[2]), up_j = std::size_t(l.nodes[2]);
    for (int i = 0; i + 1 < l.nodes[0]; ++i)
        for (int j = 0; j + 1 < l.nodes[1]; ++j)
            for (int k = 0; k + 1 < l.nodes[2]; ++k) {
                const std::size_t at = std::size_t(i) * up_i + std::size_t(j) * up_j + std::size_t(k);
                int inside = 0;
                for (int corner = 0; corner < 8; ++corner)
                    inside +=
                        values[at + (corner & 4 ? up_i : 0) + (corner & 2 ? up_j : 0) + (corner & 1 ? 1 : 0)] > 0.5F;
                if (inside == 0 || inside == 8) continue;
                const Vec3 low{l.origin[0] + i * l.cell, l.origin[1] + j * l.cell, l.origin[2] + k * l.cell};
                visit({low, {low[0] + l.cell, low[1] + l.cell, low[2] + l.cell}});
            }
}

namespace cloud {

int cells_along(const std::vector<Vec3>& points, double cell) {
    return std::clamp(int(longest_side(bounding_box(points)) * (1 + 2 * kIndicator.beyond) / cell),
                      kIndicator.least_cells, kIndicator.most_cells);
}

Lattice indicator_lattice(const std::vector<Vec3>& points, int cells) {
    return lattice_around(bounding_box(points), kIndicator.beyond, cells);
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

double share_bare(const Indicator& indicator, const std::vector<Vec3>& points, double reach) {
    const PointCells cells(points, reach);
    std::size_t all = 0, bare = 0;
    indicator.crossed([&](const WorldBox& box) {
        ++all;
        bare += !cells.any_within(times(0.5, plus(box.min, box.max)), reach);
    });
    return all > 0 ? double(bare) / double(all) : 1;
}

std::shared_ptr<const Indicator> make_indicator(const WindingField& field) {
    return std::make_shared<const Indicator>(
        std::make_unique<const Indicator::Values>(Indicator::Values{field.indicator()}));
}

void solve(WindingField& field, const std::vector<Vec3>& points, const Orientation& orientation, int cycles,
           const RunContext& run) {
    std::vector<Vec3> vectors(points.size());
    tbb::parallel_for(std::size_t(0), points.size(),
                      [&](std::size_t n) { vectors[n] = times(orientation.areas[n], orientation.normals[n]); });
    field.solve(points, vectors, cycles, run);
}

std::shared_ptr<const Indicator> indicator_of(const std::vector<Vec3>& points, const Orientation& orientation,
                                              double cell, const RunContext& run) {
    WindingField field(indicator_lattice(points, cells_along(points, cell)));
    solve(field, points, orientation, kIndicator.cycles_from_nothing, run);
    scale_to_half(field, points);
    return make_indicator(field);
}

}  // namespace cloud
}  // namespace covol
