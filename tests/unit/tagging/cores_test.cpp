#include "tagging/cores.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "covol/distance.h"
#include "covol/run.h"

using namespace covol;
using openvdb::Coord;

namespace {

/// The face-connected components of {d > level} by brute force; all that reach the domain's end form the exterior.
class Flooded {
public:
    struct Component {
        std::int64_t voxels = 0, faces = 0;
        double peak = 0;
        bool exterior = false;
    };

    Flooded(const FloatGrid& distance, double radius, double level, const Coord& seed)
        : min_(domain_of(distance).min), max_(domain_of(distance).max) {
        for (int a = 0; a < 3; ++a) size_[a] = max_[a] - min_[a] + 1;
        label_.assign(std::size_t(size_[0]) * size_[1] * size_[2], -1);
        const auto d = distance.getConstAccessor();
        const auto height = [&](const Coord& c) { return d.isValueOn(c) ? double(d.getValue(c)) : radius; };
        const auto is_open = [&](const Coord& c) { return height(c) > level; };
        std::vector<Coord> stack;
        for (std::size_t n = 0; n < label_.size(); ++n) {
            const Coord start = voxel(n);
            if (label_[n] >= 0 || !is_open(start)) continue;
            const auto own = int(components_.size());
            Component component;
            stack.assign(1, start);
            label_[n] = own;
            while (!stack.empty()) {
                const Coord c = stack.back();
                stack.pop_back();
                ++component.voxels;
                component.peak = std::max(component.peak, height(c));
                component.exterior |= c == seed;
                for (int face = 0; face < 6; ++face) {
                    Coord next = c;
                    next[face / 2] += face % 2 ? 1 : -1;
                    if (!is_inside(next)) {
                        component.exterior = true;
                        ++component.faces;
                    } else if (!is_open(next)) {
                        ++component.faces;
                    } else if (label_[number(next)] < 0) {
                        label_[number(next)] = own;
                        stack.push_back(next);
                    }
                }
            }
            components_.push_back(component);
        }
    }
    [[nodiscard]] std::vector<Component> enclosed() const {
        std::vector<Component> all;
        std::copy_if(components_.begin(), components_.end(), std::back_inserter(all),
                     [](auto& c) { return !c.exterior; });
        return all;
    }

private:
    [[nodiscard]] bool is_inside(const Coord& c) const {
        for (int a = 0; a < 3; ++a)
            if (c[a] < min_[a] || c[a] > max_[a]) return false;
        return true;
    }
    [[nodiscard]] std::size_t number(const Coord& c) const {
        return (std::size_t(c[0] - min_[0]) * size_[1] + (c[1] - min_[1])) * size_[2] + (c[2] - min_[2]);
    }
    [[nodiscard]] Coord voxel(std::size_t n) const {
        return Coord(int(n / (std::size_t(size_[1]) * size_[2])) + min_[0], int(n / size_[2] % size_[1]) + min_[1],
                     int(n % size_[2]) + min_[2]);
    }
    std::array<int, 3> min_, max_, size_{};
    std::vector<int> label_;
    std::vector<Component> components_;
};

std::vector<Vec3> points_on_balls(const std::vector<std::array<double, 4>>& balls, int count, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::vector<Vec3> points;
    for (const auto& [x, y, z, r] : balls)
        for (int n = 0; n < count; ++n) {
            const double a = normal(random), b = normal(random), c = normal(random), s = r / std::hypot(a, b, c);
            points.push_back({x + a * s, y + b * s, z + c * s});
        }
    return points;
}

}  // namespace

TEST_CASE("Cores have the saddle, volume, area and peak that a brute-force flood fill finds") {
    // The domain's end cuts the second ball. With the smallest `radius` of the tube, a large part of the balls lies
    // beyond the tube; with the largest one, nothing does.
    const std::uint64_t seed = GENERATE(1U, 2U, 3U);
    const double radius = GENERATE(6.0, 9.5, 40.0);
    const bool has_seed = GENERATE(false, true);
    CAPTURE(seed, radius, has_seed);
    const std::vector<Vec3> points = points_on_balls({{0, 0, 0, 21}, {38, 3, -2, 13}, {-3, -38, 4, 9}}, 900, seed);
    const Domain domain = make_domain({{-40, -50, -37}, {41, 30, 33}}, 1.0);
    const FloatGridPtr d = compute_distance(points, domain, {radius}).grid;
    const std::vector<Vec3> seeds = has_seed ? std::vector<Vec3>{{-3, -38, 4}} : std::vector<Vec3>{};
    const Coord seed_voxel = has_seed ? Coord(-3, -38, 4) : Coord(1000);

    const detail::Cores found = detail::find_cores(*d, radius, seeds);
    CHECK(found.tube_voxels == std::int64_t(d->activeVoxelCount()));
    std::int64_t within = 0;
    for (auto value = d->cbeginValueOn(); value; ++value) within += *value < 3.0F;
    CHECK(found.cloud_volume(3.0) == double(within));

    std::vector<detail::Core> cores = found.cores;
    REQUIRE(cores.size() > 3);
    CHECK(std::is_sorted(cores.begin(), cores.end(), [](auto& x, auto& y) { return x.saddle > y.saddle; }));
    std::sort(cores.begin(), cores.end(), [](auto& x, auto& y) { return x.volume > y.volume; });
    cores.resize(4);
    const double main = cores.front().volume;
    CHECK(main > 0.1 * 4.0 / 3.0 * 3.14159 * 21 * 21 * 21);
    for (const detail::Core& core : cores) {
        const auto equals_core = [&](const Flooded::Component& c) {
            return double(c.voxels) == core.volume && double(c.faces) * 2 / 3 == core.area &&
                   std::abs(c.peak - core.peak) < 1e-6;
        };
        const auto above = Flooded(*d, radius, core.saddle, seed_voxel).enclosed();
        CHECK(std::any_of(above.begin(), above.end(), equals_core));
        // Slightly below its saddle the core has an opening: no enclosed component contains its peak. Components beyond
        // the tube have no peak of their own and are not tested.
        if (core.peak == radius) continue;
        const auto below = Flooded(*d, radius, std::nextafter(float(core.saddle), 0.0F), seed_voxel).enclosed();
        CHECK(std::none_of(below.begin(), below.end(), [&](const Flooded::Component& c) {
            return double(c.voxels) >= core.volume && std::abs(c.peak - core.peak) < 1e-6;
        }));
    }
    // At the level at which the largest core opens, no larger component is enclosed, unless a seed opened that
    // component.
    if (has_seed) return;
    for (const auto& c : Flooded(*d, radius, cores.front().saddle, seed_voxel).enclosed())
        CHECK(double(c.voxels) <= main);
}

TEST_CASE("Cores are identical for 1, 2 and 8 threads") {
    const std::vector<Vec3> points = points_on_balls({{0, 0, 0, 21}}, 300, 5);
    const FloatGridPtr d = compute_distance(points, make_domain({{-30, -30, -30}, {30, 30, 30}}, 0.5), {8.0}).grid;
    const auto cores_with = [&](int threads) {
        RunContext run;
        run.threads = threads;
        detail::Cores cores;
        with_threads(run, [&] { cores = detail::find_cores(*d, 8.0, {}); });
        return cores;
    };
    const detail::Cores one = cores_with(1);
    REQUIRE(one.cores.size() > 1);
    for (const int threads : {2, 8}) {
        const detail::Cores many = cores_with(threads);
        CHECK(many.histogram == one.histogram);
        REQUIRE(many.cores.size() == one.cores.size());
        for (std::size_t n = 0; n < one.cores.size(); ++n) {
            CHECK(many.cores[n].saddle == one.cores[n].saddle);
            CHECK(many.cores[n].peak == one.cores[n].peak);
            CHECK(many.cores[n].volume == one.cores[n].volume);
            CHECK(many.cores[n].area == one.cores[n].area);
        }
    }
}
