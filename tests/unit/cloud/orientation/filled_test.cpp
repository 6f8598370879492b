#include "cloud/orientation/filled.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "covol/points.h"
#include "support/clouds.h"
#include "support/surface_samples.h"

using namespace covol;

namespace {

/// Random points in the interior of a shape.
std::vector<Vec3> within(const test::Solid3& shape, std::size_t count, unsigned seed) {
    std::vector<Vec3> points;
    for (unsigned n = 0; points.size() < count; ++n)
        for (const Vec3& p : test::box_cloud(10000, shape.box, 100 * seed + n))
            if (points.size() < count && shape.distance(p) < 0) points.push_back(p);
    return points;
}

std::vector<Vec3> near(const test::Solid3& shape, std::size_t count, double noise, unsigned seed) {
    test::SurfaceSample s = shape.sample(count, seed);
    test::add_noise(s, noise, seed + 10);
    return s.points;
}

/// Points on a gyroid, a periodic surface, over three periods along each axis. Neighbouring sheets are about 3 apart.
std::vector<Vec3> on_gyroid(std::size_t count, unsigned seed) {
    std::vector<Vec3> points = test::box_cloud(count, {{0, 0, 0}, {6 * M_PI, 6 * M_PI, 6 * M_PI}}, seed);
    for (Vec3& p : points)
        for (int step = 0; step < 20; ++step) {
            const auto [x, y, z] = p;
            const double value = std::sin(x) * std::cos(y) + std::sin(y) * std::cos(z) + std::sin(z) * std::cos(x);
            const Vec3 slope{std::cos(x) * std::cos(y) - std::sin(z) * std::sin(x),
                             std::cos(y) * std::cos(z) - std::sin(x) * std::sin(y),
                             std::cos(z) * std::cos(x) - std::sin(y) * std::sin(z)};
            const double squared = slope[0] * slope[0] + slope[1] * slope[1] + slope[2] * slope[2];
            for (int a = 0; a < 3; ++a) p[a] -= value * slope[a] / (squared + 0.01);
        }
    return points;
}

bool fills(const std::vector<Vec3>& points) { return cloud::fill_a_solid(points, measure_spacing(points).median, {}); }

}  // namespace

TEST_CASE("fill_a_solid: true for points within a solid, false for points on surfaces of any shape and noise") {
    for (const unsigned seed : {1, 2}) {
        CHECK(fills(within(test::ball(1), 10000, seed)));
        CHECK(fills(within(test::ball(1), 1500, seed)));
        CHECK(fills(within(test::block({1, 0.6, 0.4}), 8000, seed)));
        CHECK(fills(within(test::torus(1, 0.35), 12000, seed)));
        CHECK(fills(within(test::ball(1), 60000, seed)));
        for (const double noise : {0.0, 0.03, 0.1}) {
            INFO("noise " << noise << ", seed " << seed);
            CHECK_FALSE(fills(near(test::ball(1), 6000, noise, seed)));
            CHECK_FALSE(fills(near(test::torus(1, 0.35), 6000, 0.5 * noise, seed)));
            CHECK_FALSE(fills(near(test::shell(1, 0.5), 8000, 0.5 * noise, seed)));
            CHECK_FALSE(fills(near(test::block({0.8, 0.5, 0.05}), 6000, 0.3 * noise, seed)));
            CHECK_FALSE(fills(near(test::table(0.06), 6000, 0.5 * noise, seed)));
        }
        CHECK_FALSE(fills(within(test::ball(1), 300, seed)));  // too few to decide
    }
    for (const std::size_t count : {4000, 50000}) CHECK_FALSE(fills(on_gyroid(count, 1)));
    std::vector<Vec3> lattice;
    for (int n = 0; n < 8000; ++n) lattice.push_back({double(n % 20), double(n / 20 % 20), double(n / 400)});
    CHECK(fills(lattice));
    std::vector<Vec3> line;
    for (int n = 0; n < 2000; ++n) line.push_back({0.01 * n, 0, 0});
    CHECK_FALSE(fills(line));
}

TEST_CASE("orient_filled: the indicator's level 1/2 encloses the solid's volume, and normals point outwards") {
    for (const auto& [name, shape] : {std::pair<std::string, test::Solid3>{"ball", test::ball(1)},
                                      std::pair<std::string, test::Solid3>{"torus", test::torus(1, 0.4)}}) {
        const std::vector<Vec3> points = within(shape, 20000, 3);
        const CloudOrientation cloud = orient_cloud(points);
        CHECK(cloud.fills);
        CHECK(cloud.encloses);
        const Indicator& indicator = *cloud.orientation.indicator;
        // The volume in which the indicator is above 1/2, by random sampling.
        double found = 0, truth = 0;
        for (const Vec3& p : test::box_cloud(40000, bounding_box(points, 0.2), 4)) {
            found += indicator.inside(p) > 0.5;
            truth += shape.distance(p) < 0;
        }
        INFO(name << ": " << found / truth << " of the volume");
        CHECK(found / truth == Approx(1).margin(0.04));
        // Normals point outward at the outermost points, which lie at most 0.3 cells below the surface.
        double outward = 0, all = 0;
        for (std::size_t n = 0; n < cloud.points.size(); ++n) {
            if (shape.distance(cloud.points[n]) < -0.3 * indicator.cell()) continue;
            ++all;
            outward += test::dot(cloud.orientation.normals[n], test::normal_of(shape.distance, cloud.points[n])) > 0;
        }
        REQUIRE(all > 500);
        CHECK(outward > 0.98 * all);
    }
}

TEST_CASE("orient_cloud: noisy points on a sphere do not count as filling a solid") {
    CHECK_FALSE(orient_cloud(near(test::ball(1), 4000, 0.05, 5)).fills);
}
