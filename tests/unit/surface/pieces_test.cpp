#include "surface/pieces.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "covol/surface.h"
#include "support/clouds.h"
#include "support/shapes.h"

using namespace covol;

namespace {

constexpr double kVoxel = 0.05;
constexpr double kSmall = 0.12;  // radius of the small balls: thinner than the band
const Vec3 kBeside{1.1, 0, 0};   // the bands of the large ball and a small ball here meet
const Vec3 kFar{1.6, 0, 0};      // the bands do not meet
const Vec3 kCavity{0, 0.3, 0};

double ball(const Vec3& p, const Vec3& center, double radius) { return test::distance(p, center) - radius; }

/// A narrow band of a ball of radius 0.8 with a small cavity, and of a small ball.
FloatGridPtr solid(const Vec3& second) {
    return test::start_grid(
        test::cube_domain(80, kVoxel),
        [&](const Vec3& p) {
            return std::min(std::max(ball(p, {0, 0, 0}, 0.8), -ball(p, kCavity, kSmall)), ball(p, second, kSmall));
        },
        3 * kVoxel);
}

std::vector<Vec3> joined(std::vector<Vec3> a, const std::vector<Vec3>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

int components(const FloatGrid& grid) { return measure(extract_mesh(grid)).components; }

std::vector<Vec3> on_small(const Vec3& center, double off = 0) {
    return test::sphere_cloud(40, kSmall + off, 2, center);
}
const std::vector<Vec3> on_main = test::sphere_cloud(500, 0.8, 1);

/// Adds a ball to a narrow band. @param center  voxel at its centre
void add_ball(FloatGrid& grid, const openvdb::Coord& center, double radius) {
    const double limit = grid.background();
    const int reach = int((radius + limit) / kVoxel) + 1;
    for (const openvdb::Coord& at : openvdb::CoordBBox(center.offsetBy(-reach), center.offsetBy(reach))) {
        const double u = kVoxel * (at - center).asVec3d().length() - radius;
        if (u >= limit) continue;
        if (u > -limit)
            grid.tree().setValueOn(at, float(u));
        else
            grid.tree().setValueOff(at, float(-limit));
    }
}

}  // namespace

TEST_CASE("Pieces and cavities with points on them are kept") {
    for (const Vec3& second : {kBeside, kFar}) {
        const FloatGridPtr grid = solid(second), before = solid(second);
        REQUIRE(components(*grid) == 3);
        CHECK(detail::drop_bare_pieces(*grid, joined(joined(on_main, on_small(kCavity)), on_small(second)), 40) == 0);
        CHECK(test::identical(*grid, *before));
    }
}

TEST_CASE("Pieces and cavities with fewer points than the minimum are removed") {
    for (const Vec3& second : {kBeside, kFar}) {
        INFO("second ball at " << second[0]);
        const std::vector<Vec3> in_cavity = on_small(kCavity), on_second = on_small(second);
        const auto dropped = [&](const std::vector<Vec3>& points, std::size_t minimum, int left) {
            const FloatGridPtr grid = solid(second);
            const std::size_t count = detail::drop_bare_pieces(*grid, points, minimum);
            CHECK(components(*grid) == left);
            return count;
        };
        CHECK(dropped(joined(on_main, on_second), 1, 2) == 1);
        CHECK(dropped(joined(on_main, in_cavity), 1, 2) == 1);
        CHECK(dropped(on_main, 1, 1) == 2);
        CHECK(dropped(joined(joined(on_main, in_cavity), on_second), 41, 1) == 2);
        // The largest piece is always kept.
        CHECK(dropped({}, 1, 1) == 2);
        CHECK(dropped(joined(in_cavity, on_second), 1, 3) == 0);
    }
}

TEST_CASE("Only the piece without points is removed, and the other surfaces are kept") {
    for (const Vec3& second : {kBeside, kFar}) {
        INFO("second ball at " << second[0]);
        const FloatGridPtr grid = solid(second);
        detail::drop_bare_pieces(*grid, joined(on_main, on_small(kCavity)), 1);
        const TriangleMesh mesh = extract_mesh(*grid);
        CHECK(measure(mesh).components == 2);
        double farthest = 0;
        for (const auto& v : mesh.vertices) {
            const Vec3 p{v[0], v[1], v[2]};
            farthest =
                std::max(farthest, std::min(std::abs(ball(p, {0, 0, 0}, 0.8)), std::abs(ball(p, kCavity, kSmall))));
        }
        CHECK(farthest < 0.2 * kVoxel);
    }
}

TEST_CASE("pieces along a diagonal, far apart: those without points go, except the largest") {
    const FloatGridPtr grid = FloatGrid::create(float(3 * kVoxel));
    grid->setTransform(openvdb::math::Transform::createLinearTransform(kVoxel));
    constexpr int kBalls = 200, kMarked = 3;
    const auto center = [](int n) { return openvdb::Coord(40 * n, 56 * n, -72 * n); };
    for (int n = 0; n < kBalls; ++n) add_ball(*grid, center(n), n == 0 ? 2 * kSmall : kSmall);
    const openvdb::Vec3d marked = grid->indexToWorld(center(kMarked));
    CHECK(detail::drop_bare_pieces(*grid, on_small({marked[0], marked[1], marked[2]}), 1) == kBalls - 2);
    for (int n = 0; n < kBalls; ++n) {
        INFO("ball " << n);
        CHECK((grid->tree().getValue(center(n)) < 0) == (n == 0 || n == kMarked));
    }
}

TEST_CASE("Points within a voxel of a piece count for it, and points three voxels away do not") {
    for (const auto& [off, stays] : {std::pair{0.9, true}, std::pair{-0.9, true}, std::pair{3.0, false}}) {
        const FloatGridPtr grid = solid(kBeside);
        detail::drop_bare_pieces(*grid, joined(joined(on_main, on_small(kCavity)), on_small(kBeside, off * kVoxel)),
                                 30);
        INFO(off << " voxels");
        CHECK((components(*grid) == 3) == stays);
    }
}
