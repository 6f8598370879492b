#include "points/point_cells.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include "points/heuristics.h"
#include "points/neighbours.h"
#include "support/clouds.h"

using namespace covol;
using namespace covol::cloud;

namespace {

struct Named {
    const char* name;
    std::vector<Vec3> points;
};

/// Clouds in a box of edge about 2, each difficult for cells in its own way.
std::vector<Named> clouds(int count, unsigned seed) {
    const std::vector<Vec3> spread = test::box_cloud(count, {{-1, -1, -1}, {1, 1, 1}}, seed);
    std::vector<Vec3> clustered = spread, doubled = spread, flat = spread, line = spread;
    for (std::size_t n = 0; n < spread.size(); ++n) {
        if (n % 4)
            for (int a = 0; a < 3; ++a) clustered[n][a] = 0.3 * double(n % 3) + 0.001 * spread[n][a];
        if (n % 2) doubled[n] = doubled[n - 1];
        flat[n][2] = 0.7;
        line[n][0] = line[n][2] = -3;
    }
    // Points on the borders of cells with an edge of 0.25.
    std::vector<Vec3> lattice;
    for (int n = 0; n < count; ++n) lattice.push_back({0.25 * (n % 8), 0.25 * (n / 8 % 8), 0.25 * (n / 64)});
    return {{"spread", spread},   {"clustered", clustered},
            {"doubled", doubled}, {"flat", flat},
            {"line", line},       {"lattice", lattice},
            {"one", {{1, 2, 3}}}, {"one place", std::vector<Vec3>(20, Vec3{4, 5, 6})}};
}

bool in(const Vec3& p, const WorldBox& box) {
    for (int a = 0; a < 3; ++a)
        if (p[a] < box.min[a] || p[a] > box.max[a]) return false;
    return true;
}

double squared(const Vec3& a, const Vec3& b) {
    double d2 = 0;
    for (int n = 0; n < 3; ++n) d2 += (a[n] - b[n]) * (a[n] - b[n]);
    return d2;
}

/// A random box within slightly more than the bounding box of the points. Some boxes are flat or a single position.
WorldBox random_box(const std::vector<Vec3>& points, std::mt19937& random) {
    const WorldBox whole = bounding_box(points, 0.3);
    const auto uniform = [&] { return random() / 4294967296.0; };
    WorldBox box;
    for (int a = 0; a < 3; ++a) {
        const double x = whole.min[a] + uniform() * (whole.max[a] - whole.min[a]);
        const double y = random() % 5 ? whole.min[a] + uniform() * (whole.max[a] - whole.min[a]) : x;
        box.min[a] = std::min(x, y);
        box.max[a] = std::max(x, y);
    }
    return box;
}

}  // namespace

TEST_CASE("Point cells: every point is in exactly one cell, under its own index") {
    for (const auto& [name, points] : clouds(500, 1))
        for (const double edge : {0.01, 0.25, 10.0}) {
            INFO(name << ", edge " << edge);
            const PointCells cells(points, edge);
            std::vector<char> seen(points.size(), 0);
            REQUIRE(cells.sorted().size() == points.size());
            for (std::size_t cell = 0; cell < cells.cell_count(); ++cell) {
                const auto [begin, end] = cells.cell(cell);
                REQUIRE(begin < end);
                WorldBox box{cells.sorted()[begin], cells.sorted()[begin]};
                for (std::uint32_t at = begin; at < end; ++at) {
                    const std::uint32_t point = cells.order()[at];
                    REQUIRE(cells.sorted()[at] == points[point]);
                    ++seen[point];
                    for (int a = 0; a < 3; ++a) {
                        box.min[a] = std::min(box.min[a], points[point][a]);
                        box.max[a] = std::max(box.max[a], points[point][a]);
                    }
                }
                for (int a = 0; a < 3; ++a) REQUIRE(box.max[a] - box.min[a] <= cells.edge() * (1 + 1e-12));
            }
            CHECK(std::all_of(seen.begin(), seen.end(), [](char n) { return n == 1; }));
        }
}

TEST_CASE("Point cells: the ranges of a box contain all of its points, each at most once") {
    std::mt19937 random(2);
    for (const auto& [name, points] : clouds(500, 3))
        for (const double edge : {0.02, 0.25, 10.0}) {
            const PointCells cells(points, edge);
            std::vector<PointCells::Range> ranges{{7, 9}};
            std::size_t found = 0, of_box = 0;
            for (int trial = 0; trial < 50; ++trial) {
                const WorldBox box = random_box(points, random);
                INFO(name << ", edge " << edge << ", trial " << trial);
                cells.find(box, ranges);
                std::vector<int> seen(points.size(), 0);
                for (const PointCells::Range& range : ranges)
                    for (std::uint32_t at = range.begin; at < range.end; ++at) ++seen[cells.order()[at]];
                for (std::size_t n = 0; n < points.size(); ++n) {
                    REQUIRE(seen[n] <= 1);
                    if (in(points[n], box)) REQUIRE(seen[n] == 1);
                    found += std::size_t(seen[n]);
                    of_box += in(points[n], box);
                }
            }
            // With small cells, few points outside of the box are visited.
            if (std::string(name) == "spread" && edge == 0.02) CHECK(double(found) < 1.3 * double(of_box) + 50);
        }
}

TEST_CASE("Point cells: the ranges around a position equal those of the box around it") {
    const std::vector<Vec3> points = test::box_cloud(300, {{-1, -1, -1}, {1, 1, 1}}, 6);
    const PointCells cells(points, 0.25);
    std::vector<PointCells::Range> around, in_box;
    for (const double reach : {0.0, 0.1, 3.0})
        for (const Vec3& p : points) {
            cells.find(p, reach, around);
            cells.find({{p[0] - reach, p[1] - reach, p[2] - reach}, {p[0] + reach, p[1] + reach, p[2] + reach}},
                       in_box);
            REQUIRE(around.size() == in_box.size());
            for (std::size_t n = 0; n < around.size(); ++n)
                CHECK((around[n].begin == in_box[n].begin && around[n].end == in_box[n].end));
        }
}

TEST_CASE("Point cells: cells are enlarged if the box is too long for them, and no points give no cells") {
    std::vector<Vec3> points = test::box_cloud(300, {{-1, -1, -1}, {1, 1, 1}}, 4);
    points.push_back({1e9, -1e9, 0});
    const PointCells cells(points, 1e-3);
    CHECK(cells.edge() > 500);
    CHECK(cells.edge() < 2000);
    std::vector<PointCells::Range> ranges;
    cells.find({{1e9, -1e9, 0}, {1e9, -1e9, 0}}, ranges);
    REQUIRE(ranges.size() == 1);
    CHECK(ranges[0].end - ranges[0].begin == 1);
    CHECK(cells.order()[ranges[0].begin] == 300);

    const PointCells none({}, 1);
    CHECK(none.cell_count() == 0);
    none.find({{-1, -1, -1}, {1, 1, 1}}, ranges);
    CHECK(ranges.empty());
}

TEST_CASE("Point cells: the nearest neighbours equal those of brute force") {
    for (const auto& [name, points] : clouds(400, 5))
        for (const std::size_t count : {1, 8, 20}) {
            const double spacing = 0.15;
            const PointCells cells(points, kNear.first_radius * spacing);
            std::vector<std::vector<Neighbour>> found(points.size());
            for_nearest(cells, spacing, count,
                        [&](std::uint32_t point, const std::vector<Neighbour>& near) { found[point] = near; });
            for (std::size_t n = 0; n < points.size(); ++n) {
                INFO(name << ", " << count << " neighbours, point " << n);
                std::vector<double> all;
                for (std::size_t m = 0; m < points.size(); ++m)
                    if (m != n) all.push_back(squared(points[n], points[m]));
                std::sort(all.begin(), all.end());
                all.resize(std::min(count, all.size()));
                REQUIRE(found[n].size() == all.size());
                std::set<std::uint32_t> distinct;
                for (std::size_t k = 0; k < all.size(); ++k) {
                    const std::uint32_t other = cells.order()[found[n][k].at];
                    REQUIRE(found[n][k].squared == Approx(all[k]).margin(1e-24));
                    REQUIRE(squared(points[n], points[other]) == Approx(all[k]).margin(1e-24));
                    REQUIRE(other != n);
                    distinct.insert(other);
                }
                REQUIRE(distinct.size() == all.size());
            }
        }
}

TEST_CASE("Point cells: neighbours are found up to 39 spacings away, but not at 10000 spacings") {
    std::vector<Vec3> points;
    for (int n = 0; n < 20; ++n) points.push_back({0.1 * n, 0, 0});
    points.push_back({1.9 + 3.9, 0, 0});  // 39 spacings from the last of the points above
    points.push_back({-1000, 0, 0});
    const PointCells cells(points, 0.2);
    std::vector<std::vector<Neighbour>> found(points.size());
    for_nearest(cells, 0.1, 8, [&](std::uint32_t point, const std::vector<Neighbour>& near) { found[point] = near; });
    CHECK(found[0].size() == 8);
    REQUIRE_FALSE(found[20].empty());
    CHECK(found[20].front().squared == Approx(3.9 * 3.9));
    CHECK(found[21].empty());
}
