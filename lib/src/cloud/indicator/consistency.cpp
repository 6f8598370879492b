#include "cloud/indicator/consistency.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/geometry.h"
#include "cloud/indicator/heuristics.h"
#include "cloud/indicator/indicator.h"
#include "cloud/indicator/patches.h"

namespace covol::cloud {
namespace {

double squared_to(double value, double nearest) {
    const double off = std::min(std::abs(value - nearest), 0.5);
    return off * off;
}

/// Makes each normal parallel to the gradient slope(point) without changing its side.
template <typename Slope>
void take_directions(const std::vector<Vec3>& points, Slope slope, std::vector<Vec3>& normals) {
    tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) {
        const Vec3 along = unit(slope(points[n]));
        if (dot(along, along) > 0) normals[n] = times(dot(along, normals[n]) < 0 ? -1 : 1, along);
    });
}

double sum_of(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

}  // namespace

void take_directions(const Indicator& indicator, const std::vector<Vec3>& points, std::vector<Vec3>& normals) {
    take_directions(
        points, [&](const Vec3& p) { return indicator.at(p).gradient; }, normals);
}

Consistency::Consistency(const std::vector<Vec3>& points, std::vector<double> areas, double cell, double reach,
                         const RunContext& run)
    : points_(points),
      areas_(std::move(areas)),
      reach_(reach),
      run_(run),
      field_(indicator_grid(points, areas_, cell)),
      cells_(points, reach),
      beside_(neighbours_of(cells_)) {}

void Consistency::solve(const std::vector<Vec3>& normals) {  // starts from the solution for the previous normals
    std::vector<Vec3> vectors(points_.size());
    tbb::parallel_for(std::size_t(0), points_.size(),
                      [&](std::size_t n) { vectors[n] = times(areas_[n], normals[n]); });
    field_.solve(points_, vectors, is_solved_ ? kIteration.patch_cycles : kCyclesFromNothing, run_);
    is_solved_ = true;
    const double half = scale_to_half(field_, points_);
    for (double& area : areas_) area *= half;
}

std::vector<double> Consistency::off(std::vector<Vec3>& normals) {
    solve(normals);
    for (int n = 0; n < kCloud.settling; ++n) {
        take_directions(
            points_, [&](const Vec3& p) { return field_.indicator().at(p).gradient; }, normals);
        solve(normals);
    }
    const StackField& chi = field_.indicator();
    std::vector<double> off(points_.size());
    tbb::parallel_for(std::size_t(0), points_.size(), [&](std::size_t n) {
        double sum = squared_to(chi.value_at(points_[n]), 0.5);
        for (const double away : {-reach_, reach_}) {
            const double there = chi.value_at(plus(points_[n], times(away, normals[n])));
            sum += squared_to(there, there < 0.5 ? 0 : 1);
        }
        off[n] = sum / 3;
    });
    return off;
}

void Consistency::take_better(const std::vector<Vec3>& other, std::vector<Vec3>& own, std::vector<double>& own_off) {
    std::vector<int> differs(cells_.cell_count());
    for_points_of(cells_,
                  [&](std::size_t cell, std::uint32_t n) { differs[cell] += dot(own[n], other[n]) < 0 ? 1 : -1; });
    for (int& cell : differs) cell = cell > 0 ? 1 : 0;
    const std::vector<int> patch = patches_of(beside_, differs);
    const int patches = 1 + *std::max_element(patch.begin(), patch.end());
    if (patches == 0) return;
    const auto taken = [&](auto takes) {
        std::vector<Vec3> normals = own;
        for_points_of(cells_, [&](std::size_t cell, std::uint32_t n) {
            if (patch[cell] >= 0 && takes(std::size_t(patch[cell]))) normals[n] = other[n];
        });
        return normals;
    };
    std::vector<Vec3> all = taken([](std::size_t) { return true; });
    std::vector<double> all_off = off(all);
    // For each patch, by how much the normals of `other` decrease the sum of the deviations over the points in its
    // cells and in adjacent cells that belong to no patch.
    std::vector<double> in_cell(cells_.cell_count()), gain(std::size_t(patches), 0.0);
    for_points_of(cells_, [&](std::size_t cell, std::uint32_t n) { in_cell[cell] += own_off[n] - all_off[n]; });
    for (std::size_t cell = 0; cell < patch.size(); ++cell) {
        if (patch[cell] >= 0) {
            gain[std::size_t(patch[cell])] += in_cell[cell];
            continue;
        }
        std::vector<int> near;  // the patches next to this cell, without duplicates
        for (const std::uint32_t next : beside_[cell])
            if (patch[next] >= 0 && std::count(near.begin(), near.end(), patch[next]) == 0) near.push_back(patch[next]);
        for (const int other_patch : near) gain[std::size_t(other_patch)] += in_cell[cell];
    }
    if (std::none_of(gain.begin(), gain.end(), [](double g) { return g > 0; })) return;
    std::vector<Vec3> some = std::move(all);
    std::vector<double> some_off = std::move(all_off);
    if (std::any_of(gain.begin(), gain.end(), [](double g) { return !(g > 0); })) {
        some = taken([&](std::size_t n) { return gain[n] > 0; });
        some_off = off(some);
    }
    if (!(sum_of(some_off) < sum_of(own_off))) return;
    own = std::move(some);
    own_off = std::move(some_off);
}

}  // namespace covol::cloud
