#include "cloud/indicator/torn.h"

#include <catch2/catch.hpp>
#include <random>

#include "covol/orientation.h"
#include "support/clouds.h"
#include "support/surface_samples.h"

using namespace covol;
using namespace covol::cloud;

namespace {

constexpr int kCount = 6000;
const double kSpacing = std::sqrt(4 * M_PI / kCount);

std::size_t count_inward(const std::vector<Vec3>& points, const std::vector<Vec3>& normals) {
    std::size_t count = 0;
    for (std::size_t n = 0; n < points.size(); ++n) count += test::dot(points[n], normals[n]) < 0.5;
    return count;
}

}  // namespace

TEST_CASE("repair_torn: a reversed patch and random normals around it are repaired") {
    for (unsigned seed = 1; seed <= 5; ++seed) {
        const std::vector<Vec3> points = test::sphere_cloud(kCount, 1, seed);
        const std::vector<Vec3> random_normals = test::sphere_cloud(kCount, 1, seed + 10);
        std::vector<Vec3> normals = points;
        std::size_t wrong = 0;
        for (std::size_t n = 0; n < points.size(); ++n) {
            if (points[n][2] < 0.95) continue;
            ++wrong;
            normals[n] = points[n][2] > 0.97 ? test::scaled(-1, points[n]) : random_normals[n];
        }
        REQUIRE(wrong > 100);
        CHECK(repair_torn(points, kSpacing, normals) > wrong / 2);
        CHECK(count_inward(points, normals) == 0);
    }
}

TEST_CASE("repair_torn: correct normals of a sphere and of both sides of a plate are unchanged") {
    const std::vector<Vec3> ball = test::sphere_cloud(kCount, 1, 3);
    std::vector<Vec3> normals = ball;
    CHECK(repair_torn(ball, kSpacing, normals) == 0);
    CHECK(normals == ball);

    std::mt19937 random(4);
    std::uniform_real_distribution<double> along(0, 1);
    std::vector<Vec3> plate, out;
    for (int n = 0; n < kCount; ++n) {
        const bool above = random() % 2 == 0;
        plate.push_back({along(random), along(random), above ? 0.04 : 0});
        out.push_back({0, 0, above ? 1.0 : -1.0});
    }
    const std::vector<Vec3> before = out;
    CHECK(repair_torn(plate, std::sqrt(2.0 / kCount), out) == 0);
    CHECK(out == before);
}

TEST_CASE("orient: all normals of an open hemisphere point outwards") {
    for (unsigned seed = 1; seed <= 4; ++seed) {
        std::vector<Vec3> points;
        for (const Vec3& p : test::sphere_cloud(12000, 1, seed))
            if (p[2] > 0) points.push_back(p);
        const Orientation o = orient(points, measure_cloud_scale(points));
        CHECK(count_inward(points, o.normals) == 0);
    }
}
