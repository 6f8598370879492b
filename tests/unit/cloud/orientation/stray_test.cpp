#include "cloud/orientation/stray.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <random>

#include "support/clouds.h"
#include "support/surface_samples.h"

using namespace covol;
using namespace covol::cloud;

namespace {

std::size_t count(const std::vector<char>& stray, std::size_t begin, std::size_t end) {
    return std::size_t(std::count(stray.begin() + std::ptrdiff_t(begin), stray.begin() + std::ptrdiff_t(end), 1));
}

}  // namespace

TEST_CASE("find_stray: points spread through space are stray, those of a noisy surface are not") {
    for (const unsigned seed : {1, 2, 3}) {
        const test::Solid3 shape = test::torus(1, 0.35);
        test::SurfaceSample s = shape.sample(4000, seed);
        test::add_noise(s, 0.3 * s.spacing(), seed + 10);
        std::vector<Vec3> points = s.points;
        for (const Vec3& p : test::box_cloud(400, {{-3, -3, -3}, {3, 3, 3}}, seed + 20))
            if (shape.distance(p) > 6 * s.spacing()) points.push_back(p);
        const std::vector<char> stray = find_stray(points, {s.spacing(), 0, 0}, {});
        INFO("seed " << seed << ": " << count(stray, 0, 4000) << " of the surface, "
                     << count(stray, 4000, points.size()) << " of " << points.size() - 4000);
        CHECK(count(stray, 0, 4000) <= 4);
        CHECK(double(count(stray, 4000, points.size())) > 0.95 * double(points.size() - 4000));
    }
}

TEST_CASE("find_stray: points in sparse parts of a surface are not stray") {
    for (const unsigned seed : {1, 2, 3}) {
        // On one half of the sphere only one point in sixteen is kept, so that points there are four times as far
        // apart.
        const test::SurfaceSample s = test::ball(1).sample(6000, seed);
        std::mt19937 random(seed);
        std::vector<Vec3> points;
        std::size_t sparse = 0;
        for (const Vec3& p : s.points) {
            if (p[2] > 0 && random() % 16 != 0) continue;
            sparse += p[2] > 0;
            points.push_back(p);
        }
        REQUIRE(sparse > 100);
        const std::vector<char> stray = find_stray(points, {s.spacing(), 0, 0}, {});
        INFO("seed " << seed << ": " << count(stray, 0, points.size()) << ", sparse " << sparse);
        CHECK(double(count(stray, 0, points.size())) < 0.05 * double(sparse));
    }
}

TEST_CASE("find_stray: a point above a sheet is stray if it is far from it, and not if it is close") {
    std::vector<Vec3> points;
    for (int i = 0; i < 40; ++i)
        for (int j = 0; j < 40; ++j) points.push_back({0.1 * i, 0.1 * j, 0});
    points.push_back({2.03, 2.01, 0.1});
    points.push_back({1.03, 1.01, 0.9});
    points.push_back({2, 2, 500});  // beyond the search radius for neighbours
    const std::vector<char> stray = find_stray(points, {0.1, 0, 0}, {});
    CHECK(count(stray, 0, 1600) == 0);
    CHECK_FALSE(stray[1600]);
    CHECK(stray[1601]);
    CHECK(stray[1602]);
}

TEST_CASE("find_stray: a few points and coincident points are not stray") {
    const std::vector<Vec3> few = test::box_cloud(16, {{-1, -1, -1}, {1, 1, 1}}, 1);
    CHECK(count(find_stray(few, {0.01, 0, 0}, {}), 0, 16) == 0);
    CHECK(find_stray({}, {1, 0, 0}, {}).empty());
    const std::vector<char> at_one_place = find_stray(std::vector<Vec3>(100, Vec3{1, 2, 3}), {0.1, 0, 0}, {});
    CHECK(count(at_one_place, 0, 100) == 0);
}
