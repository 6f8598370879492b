// Compares LevelSet with closed forms for balls.
#include "covol/level_set.h"

#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "covol/error.h"
#include "covol/start.h"
#include "support/scratch.h"

using namespace covol;

namespace {

constexpr double kH = 0.25;
const Domain kDomain = make_domain({{-6, -6, -6}, {6, 6, 6}}, kH);

LevelSet ball(const Vec3& center, double radius, const Domain& domain = kDomain) {
    return LevelSet::from(*start_from_sphere(domain, center, radius));
}

double volume_of(double radius) { return 4 * std::numbers::pi / 3 * std::pow(radius, 3); }

/// The volume of the intersection of two balls of the given radius whose centres are `apart`.
double lens(double radius, double apart) {
    return std::numbers::pi * (4 * radius + apart) * std::pow(2 * radius - apart, 2) / 12;
}

}  // namespace

TEST_CASE("LevelSet: samples are signed distances, clamped to the half width of the band") {
    const LevelSet surface = ball({0.1, 0, -0.2}, 3);
    const std::vector<Vec3> places{{3.1, 0, -0.2}, {0.1, 3.3, -0.2}, {0.1, 0, 2.5}, {0.1, 0, -0.2}, {5.5, 5.5, 5.5}};
    const std::vector<double> expected{0, 0.3, -0.3, -kHalfWidthVoxels * kH, kHalfWidthVoxels * kH},
        found = surface.sample(places);
    for (std::size_t n = 0; n < places.size(); ++n) {
        CHECK(std::abs(found[n] - expected[n]) < 0.04 * kH);
        CHECK(surface.sample(places[n]) == found[n]);
    }
}

TEST_CASE("LevelSet: the offset of a ball is a ball of the new radius, also for offsets beyond the band") {
    const LevelSet surface = ball({0.1, 0, -0.2}, 3);
    for (const double distance : {-2.0, -0.4, 0.0, 0.4, 2.0}) {
        const LevelSet moved = surface.offset(distance);
        // The tolerance is a tenth of a voxel, because distances far from the surface are measured to its triangles.
        const double error = 0.1 * kH, radius = 3 + distance;
        CHECK(std::abs(moved.measure().volume - volume_of(radius)) < volume_of(radius + error) - volume_of(radius));
        CHECK(std::abs(moved.sample({0.1 + radius, 0, -0.2})) < error);
        CHECK(moved.domain() == surface.domain());
    }
    CHECK_THROWS_AS(surface.offset(-3.5), Error);
    CHECK_THROWS_AS(surface.offset(std::nan("")), Error);
}

TEST_CASE("LevelSet: unions, intersections and differences have the expected volumes and distances") {
    const double apart = 3;
    const LevelSet a = ball({-1.5, 0, 0}, 2.5), b = ball({1.5, 0, 0}, 2.5);
    // The second ball on another lattice, so that its level set must be resampled.
    const LevelSet other = ball({1.5, 0, 0}, 2.5, make_domain({{-5, -5, -5}, {5, 5, 5}}, 0.2));
    const double shared = lens(2.5, apart), one = volume_of(2.5);
    // Along the circle of radius 2 where the surfaces cross, triangles round the edge by less than half a voxel each
    // way.
    const double ring = 2 * std::numbers::pi * 2, error = ring * 0.5 * kH * kH + 0.01 * one;
    for (const LevelSet& second : {b, other}) {
        CHECK(std::abs(a.united(second).measure().volume - (2 * one - shared)) < 2 * error);
        CHECK(std::abs(a.intersected(second).measure().volume - shared) < error);
        CHECK(std::abs(a.without(second).measure().volume - (one - shared)) < error);
        CHECK(a.united(second).domain() == a.domain());
    }
    // Inside the waist of the union, the distance is that to the seam of the two balls. The parts of a ball's surface
    // that lie within the other ball do not count.
    CHECK(a.united(b).sample({0, 1.5, 0}) == Approx(-0.5).margin(0.4 * kH));
    CHECK_THROWS_AS(ball({-4, 0, 0}, 1).intersected(ball({4, 0, 0}, 1)), Error);
}

TEST_CASE("LevelSet: a null grid, another grid class and another background are rejected") {
    CHECK(message_of([] { LevelSet(nullptr); }) == "LevelSet: expected a grid, got none");
    const FloatGridPtr fog = make_grid(kDomain, 0.0F, "fog");
    CHECK(message_of([&] { LevelSet{fog}; }).find("expected a grid of class level set") != std::string::npos);
    fog->setGridClass(openvdb::GRID_LEVEL_SET);
    CHECK(message_of([&] { LevelSet{fog}; }).find("expected a background of 0.75, got 0") != std::string::npos);
    CHECK_THROWS_AS(LevelSet::from(*fog), Error);
}
