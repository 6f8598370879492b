#include "covol/seeds.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "covol/error.h"
#include "covol/start.h"
#include "support/scratch.h"

using namespace covol;

namespace {

Domain cube(int n) {
    Domain domain;
    domain.max = {n - 1, n - 1, n - 1};
    return domain;
}

double value_at(const FloatGrid& grid, const Vec3& p) {
    return double(openvdb::tools::BoxSampler::sample(grid.tree(),
                                                     grid.transform().worldToIndex(openvdb::Vec3d(p[0], p[1], p[2]))));
}

}  // namespace

TEST_CASE("Lines of seeds are sampled along their length, like scribbles", "[seeds]") {
    PointCloud cloud;
    cloud.points = {{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {9, 9, 9}};
    MarkLine line;
    line.end = 3;
    line.closed = false;
    cloud.lines = {line};
    const std::vector<Vec3> seeds = collect_seeds(cloud, 1);
    CHECK(seeds.size() == 9);  // x = 0 to 4, then y = 1 to 3, and the single seed
    CHECK(seeds.back() == Vec3{9, 9, 9});
    cloud.lines[0].closed = true;
    CHECK(collect_seeds(cloud, 1).size() == 13);
}

TEST_CASE("start_from_seeds: a ball around the inside seed with half the distance to the outside seed as radius",
          "[seeds]") {
    const FloatGridPtr grid = start_from_seeds(cube(64), {{20, 32, 32}}, {{40, 32, 32}});
    CHECK(value_at(*grid, {30, 32, 32}) == Approx(0).margin(0.05));
    CHECK(value_at(*grid, {29, 32, 32}) == Approx(-1).margin(0.1));
    // The body lies within a ball around the seed inside, with half of the seeds' distance as radius. This position is
    // in the middle plane, but outside of the ball.
    CHECK(value_at(*grid, {30, 34, 32}) >= -0.01);
    CHECK(value_at(*grid, {10, 32, 32}) == Approx(0).margin(0.1));
    CHECK(value_at(*grid, {20, 32, 42}) == Approx(0).margin(0.1));
}

TEST_CASE("start_from_seeds: seeds inside are connected, and a single one makes a ball of three voxels", "[seeds]") {
    const FloatGridPtr joined = start_from_seeds(cube(64), {{12, 32, 32}, {32, 32, 32}, {52, 32, 32}}, {});
    for (double x = 12; x <= 52; x += 1) CHECK(value_at(*joined, {x, 32, 32}) < 0);
    const FloatGridPtr alone = start_from_seeds(cube(64), {{32, 32, 32}}, {});
    CHECK(value_at(*alone, {35, 32, 32}) == Approx(0).margin(0.1));
}

TEST_CASE("start_from_seeds: no seeds inside, or none of them in the domain, is an error", "[seeds]") {
    CHECK(message_of([] {
              (void)start_from_seeds(cube(8), {}, {{1, 1, 1}});
          }).find("expected seeds inside, got none") != std::string::npos);
    CHECK(message_of([] {
              (void)start_from_seeds(cube(8), {{100, 0, 0}}, {});
          }).find("at least one seed in the domain, got none of 1") != std::string::npos);
}

TEST_CASE("check_seeds: seeds on the wrong side of a surface are counted and reported", "[seeds]") {
    const FloatGridPtr ball = start_from_sphere(cube(64), {32, 32, 32}, 10);
    const SeedCheck right = check_seeds(*ball, {{32, 32, 32}, {40, 32, 32}}, {{44, 32, 32}, {0, 0, 0}});
    CHECK(right.wrong() == 0);
    CHECK(right.warning().empty());
    const SeedCheck wrong = check_seeds(*ball, {{32, 32, 32}, {44, 32, 32}}, {{32, 32, 40}, {0, 0, 0}});
    CHECK(wrong.wrong_inside == 1);
    CHECK(wrong.wrong_outside == 1);
    CHECK(wrong.first == Vec3{44, 32, 32});
    CHECK(wrong.farthest == Approx(2).margin(0.1));
    CHECK(wrong.warning().find("2 of 4 seeds lie on the wrong side") == 0);
    CHECK(check_seeds(*ball, {{44, 32, 32}}, {}, 2.5).wrong() == 0);
}

TEST_CASE("check_sides: a position that is both inside and outside is rejected", "[seeds]") {
    check_sides({{1, 2, 3}}, {{1, 2, 3.1}}, 0.01);
    CHECK(message_of([] {
              check_sides({{1, 2, 3}}, {{5, 5, 5}, {1, 2, 3}}, 0.01);
          }).find("got (1, 2, 3) inside and outside") != std::string::npos);
}
