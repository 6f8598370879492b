#include <algorithm>
#include <catch2/catch.hpp>

#include "covol/points.h"
#include "support/clouds.h"

using namespace covol;

namespace {

/// Marks on a sphere of radius 10 around the origin.
std::vector<Vec3> sphere(int count, unsigned seed) {
    std::vector<Vec3> marks = test::box_cloud(count, {{-1, -1, -1}, {1, 1, 1}}, seed);
    for (Vec3& m : marks) {
        const double length = std::hypot(m[0], m[1], m[2]);
        for (double& x : m) x *= 10 / length;
    }
    return marks;
}

std::vector<std::size_t> indices(const std::vector<IsolatedPoint>& isolated) {
    std::vector<std::size_t> found;
    for (const IsolatedPoint& one : isolated) found.push_back(one.index);
    std::sort(found.begin(), found.end());
    return found;
}

}  // namespace

TEST_CASE("Marks on a body are not isolated") {
    for (const int count : {10, 20, 60, 300})
        for (unsigned seed = 0; seed < 30; ++seed) {
            CAPTURE(count, seed);
            CHECK(find_isolated_points(sphere(count, seed)).empty());
        }
    CHECK(find_isolated_points({}).empty());
    CHECK(find_isolated_points(std::vector<Vec3>(50, Vec3{1, 2, 3})).empty());
}

TEST_CASE("Duplicate marks are not isolated, and a distant mark is isolated although it occurs four times") {
    for (const int count : {20, 60, 300})
        for (const double apart : {0.0, 1e-6, 1e-3})
            for (unsigned seed = 0; seed < 10; ++seed) {
                CAPTURE(count, apart, seed);
                const std::vector<Vec3> once = sphere(count, seed);
                std::vector<Vec3> some = once, all = once, with_stray = once;
                some.push_back({once[3][0] + apart, once[3][1], once[3][2]});
                for (const Vec3& m : once) all.push_back({m[0], m[1] - apart, m[2]});
                CHECK(find_isolated_points(some).empty());
                CHECK(find_isolated_points(all).empty());
                with_stray.insert(with_stray.end(), 4, Vec3{0, 0, 60});
                CHECK(indices(find_isolated_points(with_stray)).size() == 4);
            }
}

TEST_CASE("Marks of contours on slices far apart are not isolated") {
    std::vector<Vec3> marks;
    for (int slice = 0; slice < 4; ++slice)
        for (int n = 0; n < 24; ++n)
            marks.push_back({10 * std::cos(n * 0.2618), 10 * std::sin(n * 0.2618), 25.0 * slice});
    CHECK(find_isolated_points(marks).empty());
}

TEST_CASE("Marks of two bodies are not isolated") {
    std::vector<Vec3> marks = sphere(60, 1);
    for (const Vec3& m : sphere(12, 2)) marks.push_back({m[0] + 100, m[1], m[2]});
    CHECK(find_isolated_points(marks).empty());
}

TEST_CASE("Marks far from all others are isolated, and the farthest is listed first") {
    for (const int count : {20, 60, 300})
        for (unsigned seed = 0; seed < 10; ++seed) {
            CAPTURE(count, seed);
            std::vector<Vec3> marks = sphere(count, seed);
            marks.push_back({0, 0, 40});
            marks.insert(marks.begin() + 5, Vec3{60, 0, 0});
            const std::vector<IsolatedPoint> isolated = find_isolated_points(marks);
            REQUIRE(isolated.size() == 2);
            CHECK(isolated[0].index == 5);
            CHECK(isolated[0].distance > 50 - 1e-9);
            CHECK(isolated[0].distance < 58);
            CHECK(isolated[1].index == marks.size() - 1);
        }
}

TEST_CASE("Many marks scattered over an image are isolated if the body is small") {
    for (unsigned seed = 0; seed < 10; ++seed) {
        CAPTURE(seed);
        std::vector<Vec3> marks = sphere(285, seed);
        std::vector<std::size_t> stray;
        for (const Vec3& m : test::box_cloud(15, {{-80, -80, -80}, {80, 80, 80}}, seed + 100)) {
            if (std::hypot(m[0], m[1], m[2]) > 25) stray.push_back(marks.size());
            marks.push_back(m);
        }
        const std::vector<std::size_t> found = indices(find_isolated_points(marks));
        CHECK(std::includes(found.begin(), found.end(), stray.begin(), stray.end()));
        CHECK((found.empty() || found.front() >= 285));
    }
}

TEST_CASE("An isolated mark is found also in reversed order of the marks") {
    std::vector<Vec3> marks = sphere(80, 3);
    marks.push_back({0, 50, 0});
    std::reverse(marks.begin(), marks.end());
    CHECK(indices(find_isolated_points(marks)) == std::vector<std::size_t>{0});
}
