#include "covol/distance.h"

#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>

#include "covol/error.h"
#include "support/clouds.h"

using namespace covol;
using namespace covol::test;

namespace {

/// Checks that every active voxel has the exact distance, and that the active voxels are exactly the domain's voxels
/// within the tube of the given radius.
void check_against_brute_force(const std::vector<Vec3>& points, const Domain& domain, double radius) {
    const DistanceResult result = compute_distance(points, domain, {radius});
    std::int64_t active = 0;
    double worst = 0;
    int misplaced = 0;
    for (int i = domain.min[0]; i <= domain.max[0]; ++i)
        for (int j = domain.min[1]; j <= domain.max[1]; ++j)
            for (int k = domain.min[2]; k <= domain.max[2]; ++k) {
                const double d = brute_force_distance(points, world_of(domain, {i, j, k}));
                const bool is_active = result.grid->tree().isValueOn({i, j, k});
                if (std::abs(d - radius) > 1e-3 * domain.voxel_size && is_active != (d < radius)) ++misplaced;
                if (is_active) worst = std::max(worst, std::abs(d - result.grid->tree().getValue({i, j, k})));
                active += is_active;
            }
    CHECK(misplaced == 0);
    CHECK(worst <= 1e-4 * domain.voxel_size);
    CHECK(result.report.active_voxels == active);
    CHECK(std::int64_t(result.grid->activeVoxelCount()) == active);
    CHECK(result.grid->background() == float(radius));
}

const Domain kCube = make_domain({{0, 0, 0}, {10, 10, 10}}, 0.25);  // 40^3 voxels

}  // namespace

TEST_CASE("compute_distance: distances around a single point are exact") {
    check_against_brute_force({{5.03, 4.91, 5.2}}, kCube, 2.0);
    check_against_brute_force({{0.01, 9.99, 5}}, kCube, 3.1);
}

TEST_CASE("compute_distance: distances around a few points are exact") {
    check_against_brute_force(box_cloud(7, {{0, 0, 0}, {10, 10, 10}}, 1), kCube, 2.5);
}

TEST_CASE("compute_distance: repeated points change nothing") {
    const std::vector<Vec3> once = box_cloud(5, {{2, 2, 2}, {8, 8, 8}}, 2);
    std::vector<Vec3> thrice = once;
    thrice.insert(thrice.end(), once.begin(), once.end());
    thrice.insert(thrice.end(), once.begin(), once.end());
    CHECK(identical(*compute_distance(once, kCube, {2.0}).grid, *compute_distance(thrice, kCube, {2.0}).grid));
}

TEST_CASE("compute_distance: points outside of the domain count") {
    check_against_brute_force({{-1.5, 5, 5}, {-0.9, 7, 5}, {5, 11, 11}}, kCube, 2.5);
    SECTION("but only within the radius") {
        const DistanceResult far = compute_distance({{-3, 5, 5}}, kCube, {2.5});
        CHECK(far.report.active_voxels == 0);
        CHECK(far.grid->tree().leafCount() == 0);
    }
}

TEST_CASE("compute_distance: distances are exact at large indices, too") {
    Domain far = kCube;
    far.min = {1 << 20, -(1 << 21), 1 << 19};
    for (int a = 0; a < 3; ++a) {
        far.max[a] = far.min[a] + 39;
        far.origin[a] = 0.125 - 0.25 * far.min[a];
    }
    const std::vector<Vec3> points = box_cloud(5, {{1, 1, 1}, {9, 9, 9}}, 3);
    check_against_brute_force(points, far, 2.0);
}

TEST_CASE("compute_distance: distances to a dense cluster in a few voxels are accurate to 0.1 voxels") {
    const std::vector<Vec3> points = box_cloud(20000, {{5, 5, 5}, {5.6, 5.6, 5.6}}, 4);
    const DistanceResult result = compute_distance(points, kCube, {2.0});
    double worst = 0;
    for (auto value = result.grid->cbeginValueOn(); value; ++value)
        worst = std::max(worst, *value - brute_force_distance(points, world_of(kCube, value.getCoord())));
    CHECK(worst <= 0.1 * kCube.voxel_size);
}

TEST_CASE("compute_distance: distances are bit-identical for 1, 2 and 8 threads") {
    const std::vector<Vec3> points = sphere_cloud(3000, 3.5, 5, {5, 5, 5});
    RunContext run;
    run.threads = 1;
    const DistanceResult one = compute_distance(points, kCube, {1.5}, run);
    for (const int threads : {2, 8}) {
        run.threads = threads;
        const DistanceResult many = compute_distance(points, kCube, {1.5}, run);
        CHECK(identical(*one.grid, *many.grid));
        CHECK(one.report.rounds == many.report.rounds);
    }
}

TEST_CASE("compute_distance: mirrored and permuted points give mirrored and permuted distances") {
    Domain domain;  // symmetric about the origin
    domain.voxel_size = 0.5;
    domain.min = {-20, -20, -20};
    domain.max = {20, 20, 20};
    const std::vector<Vec3> points = sphere_cloud(200, 6.0, 6);
    std::vector<Vec3> moved = points;
    for (Vec3& p : moved) p = {-p[2], p[0], -p[1]};
    const DistanceResult a = compute_distance(points, domain, {3.0}), b = compute_distance(moved, domain, {3.0});
    // The result depends on the order of the sweeps, which is not rotated with the cloud: each of the two grids may
    // miss the nearest point of a few voxels and have a slightly larger distance there.
    double worst = 0, sum = 0;
    for (auto value = a.grid->cbeginValueOn(); value; ++value) {
        const openvdb::Coord c = value.getCoord();
        const double difference = std::abs(*value - b.grid->tree().getValue({-c.z(), c.x(), -c.y()}));
        worst = std::max(worst, difference);
        sum += difference;
    }
    CHECK(worst <= 0.1 * domain.voxel_size);
    CHECK(sum / double(a.report.active_voxels) <= 1e-4 * domain.voxel_size);
}

TEST_CASE("compute_distance: invalid points and radii are rejected, and a run can be cancelled") {
    const auto code = [](const std::vector<Vec3>& points, double radius) {
        try {
            (void)compute_distance(points, kCube, {radius});
        } catch (const Error& e) {
            return e.code();
        }
        return Errc::Io;
    };
    CHECK(code({}, 1) == Errc::InvalidInput);
    CHECK(code({{0, std::nan(""), 0}}, 1) == Errc::InvalidInput);
    CHECK(code({{1, 1, 1}}, 0) == Errc::InvalidOptions);
    CHECK(code({{1, 1, 1}}, INFINITY) == Errc::InvalidOptions);
    const std::atomic<bool> cancel = true;
    RunContext run;
    run.cancel = &cancel;
    CHECK_THROWS_AS(compute_distance({{1, 1, 1}}, kCube, {1.0}, run), Error);
}
