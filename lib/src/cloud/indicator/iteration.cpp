#include "cloud/indicator/iteration.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "cloud/indicator/heuristics.h"
#include "cloud/indicator/indicator.h"
#include "cloud/indicator/patches.h"
#include "cloud/indicator/torn.h"

namespace covol::cloud {
namespace {

/// For each cell, the mean of the indicator over its points, minus 1/2.
std::vector<double> mean_off(const PointCells& cells, const StackField& chi) {
    std::vector<double> off(cells.cell_count());
    tbb::parallel_for(std::size_t(0), off.size(), [&](std::size_t cell) {
        const auto [begin, end] = cells.cell(cell);
        double sum = 0;
        for (std::uint32_t at = begin; at < end; ++at) sum += chi.value_at(cells.sorted()[at]) - 0.5;
        off[cell] = sum / double(end - begin);
    });
    return off;
}

/// For each cell, the sign of the deviation of its mean indicator from 1/2; 0 if the deviation is too small for the
/// cell to belong to a patch.
std::vector<int> sides_of(const std::vector<double>& off) {
    std::vector<int> side;
    for (const double x : off) side.push_back(std::abs(x) < kIteration.patch_off ? 0 : x < 0 ? -1 : 1);
    return side;
}

}  // namespace

Iteration::Iteration(const std::vector<Vec3>& points, const std::vector<double>& areas, const RunContext& run)
    : points_(points), areas_(areas), run_(run) {}

void Iteration::run(const Stage& stage, Orientation& result) {
    WindingField field(indicator_grid(points_, areas_, stage.cell));
    if (last_) field.start_from(last_->indicator());
    stage_ = stage;
    if (result.normals.empty()) estimate_normals(stage.cell, result);
    for (int n = 0; n < stage.iterations; ++n) {
        ++result.iterations;
        if (turn(field, result, 1) < kIteration.steady) break;
    }
    turn_patches(field, result);
    if (stage.is_last) turn(field, result, kIteration.last_cycles);
    last_.emplace(std::move(field));
}

void Iteration::mend(double spacing, Orientation& result) {
    result.mended = repair_torn(points_, spacing, result.normals);
    if (result.mended > 0) solve(*last_, result, kIteration.last_cycles);
}

void Iteration::estimate_normals(double cell, Orientation& result) const {
    const StackField density =
        spread(grid_around(points_, areas_, kCloud.coarse * cell), points_, std::vector<double>(points_.size(), 1.0));
    result.normals.resize(points_.size());
    tbb::parallel_for(std::size_t(0), points_.size(), [&](std::size_t n) {
        const Vec3 g = density.at(points_[n]).gradient;
        result.normals[n] = unit({-g[0], -g[1], -g[2]});
    });
}

/// Computes the indicator of the normals, scales it to 1/2 at the points, and scales the areas by the same factor.
void Iteration::solve(WindingField& field, Orientation& result, int cycles) {
    cloud::solve(field, points_, result, cycles, run_);
    const double half = scale_to_half(field, points_);
    for (double& area : result.areas) area *= half;
}

/// Computes the indicator of the normals, then replaces the normals by those of that indicator.
/// @return mean of 1 - cosine of the angles between old and new normals
double Iteration::turn(WindingField& field, Orientation& result, int cycles) {
    solve(field, result, cycles);
    const std::size_t count = points_.size();
    const StackField& chi = field.indicator();
    std::vector<double> cosine(count);
    tbb::parallel_for(std::size_t(0), count, [&](std::size_t n) {
        const StackField::Sample here = chi.at(points_[n]);
        const double sign = here.value < 0 || here.value > stage_.enclosed ? 1 : -1;
        const Vec3 normal = unit({sign * here.gradient[0], sign * here.gradient[1], sign * here.gradient[2]});
        cosine[n] = dot(normal, result.normals[n]);
        if (dot(normal, normal) > 0) result.normals[n] = normal;
    });
    result.turned = double(std::count_if(cosine.begin(), cosine.end(), [](double c) { return c < 0; })) / double(count);
    return 1 - std::accumulate(cosine.begin(), cosine.end(), 0.0) / double(count);
}

/// The iteration cannot correct a patch whose normals are all reversed, because their indicator reproduces them; but
/// the mean of the indicator over such a patch differs from 1/2. All such patches are therefore reversed
/// tentatively, at once, and those remain reversed in which the mean comes closer to 1/2.
void Iteration::turn_patches(WindingField& field, Orientation& result) {
    const PointCells cells(points_, kCloud.coarse * field.indicator().stack().cell());
    const std::vector<std::vector<std::uint32_t>> beside = neighbours_of(cells);
    for (int round = 0; round < kCommon.rounds; ++round) {
        turn(field, result, kIteration.patch_cycles);  // updates field.indicator(), which mean_off() needs
        const std::vector<double> off = mean_off(cells, field.indicator());
        const std::vector<int> patch = patches_of(beside, sides_of(off));
        const int patches = 1 + *std::max_element(patch.begin(), patch.end());
        if (patches == 0) return;
        const std::vector<Vec3> before = result.normals;
        for_points_of(cells, [&](std::size_t cell, std::uint32_t point) {
            if (patch[cell] >= 0)
                for (double& c : result.normals[point]) c = -c;
        });
        solve(field, result, kIteration.patch_cycles);
        const std::vector<double> turned = mean_off(cells, field.indicator());
        std::vector<double> gain(std::size_t(patches), 0.0);
        for (std::size_t cell = 0; cell < patch.size(); ++cell) {
            if (patch[cell] < 0) continue;
            const auto [begin, end] = cells.cell(cell);
            gain[std::size_t(patch[cell])] +=
                double(end - begin) * (off[cell] * off[cell] - turned[cell] * turned[cell]);
        }
        double stayed = 0;
        for_points_of(cells, [&](std::size_t cell, std::uint32_t point) {
            if (patch[cell] < 0) return;
            if (gain[std::size_t(patch[cell])] > 0)
                ++stayed;
            else
                result.normals[point] = before[point];
        });
        for (int n = 0; n < kCloud.settling; ++n) turn(field, result, kIteration.patch_cycles);
        if (stayed < kCloud.few * double(points_.size())) return;
    }
}

std::vector<Vec3> normals_of(const Indicator& indicator, const std::vector<Vec3>& points, double enclosed) {
    std::vector<Vec3> normals(points.size());
    tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) {
        const auto [inside, g, cell] = indicator.at(points[n]);
        const double sign = inside < 0 || inside > enclosed ? 1 : -1;
        normals[n] = unit({sign * g[0], sign * g[1], sign * g[2]});
    });
    return normals;
}

}  // namespace covol::cloud
