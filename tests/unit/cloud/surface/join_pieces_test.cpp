#include "cloud/surface/join_pieces.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "covol/surface.h"
#include "support/clouds.h"
#include "support/shapes.h"

using namespace covol;

namespace {

constexpr double kVoxel = 0.05, kRadius = 0.6, kThin = 0.12, kSpacing = 0.2;
const Vec3 kBody{-0.5, 0, 0};

double ball(const Vec3& p, const Vec3& center, double radius) { return test::distance(p, center) - radius; }

/// The centre of a small ball of radius kThin whose surface is `gap` from that of the body.
Vec3 ball_center(double gap) { return {kBody[0] + kRadius + gap + kThin, 0, 0}; }
/// The level set of the body, which has a cavity, and of the small ball.
FloatGridPtr body_and_ball(double gap, double ball_radius = kThin) {
    const Vec3 at{ball_center(gap)[0] + ball_radius - kThin, 0, 0};
    return test::start_grid(
        test::cube_domain(80, kVoxel),
        [&](const Vec3& p) {
            return std::min(std::max(ball(p, kBody, kRadius), -ball(p, kBody, 0.2)), ball(p, at, ball_radius));
        },
        3 * kVoxel);
}

/// Points on the body and on the small ball and, if `between`, along the missing part between them.
std::vector<Vec3> points(double gap, bool between) {
    std::vector<Vec3> all = test::sphere_cloud(400, kRadius, 1, kBody);
    for (const Vec3& p : test::sphere_cloud(40, kThin, 2, ball_center(gap))) all.push_back(p);
    const double begin = kBody[0] + kRadius;
    for (double x = begin; between && x < begin + gap; x += 0.5 * kSpacing)
        for (const double angle : {0.3, 2.4, 4.5}) all.push_back({x, kThin * std::cos(angle), kThin * std::sin(angle)});
    return all;
}

}  // namespace

TEST_CASE("join_pieces: a small piece is joined across a short gap only if points lie all along it") {
    for (const double gap : {1.5, 3.0}) {
        INFO(gap << " apart");
        const FloatGridPtr with = body_and_ball(gap * kSpacing), without = body_and_ball(gap * kSpacing),
                           before = body_and_ball(gap * kSpacing);
        REQUIRE(measure(extract_mesh(*with)).components == 3);  // the body, its cavity and the small ball
        CHECK(cloud::join_pieces(*with, points(gap * kSpacing, true), kSpacing, {}) == 1);
        const MeshMeasures joined = measure(extract_mesh(*with));
        CHECK(joined.components == 2);
        CHECK(joined.genus == 0);
        CHECK(joined.closed);
        // The pieces are joined by a rod. Its volume is that of a cylinder with half of the points' spacing as radius,
        // up to a factor of about 3.
        const double grown = joined.volume - measure(extract_mesh(*before)).volume;
        CHECK(grown > 0.3 * M_PI * 0.25 * kSpacing * kSpacing * gap * kSpacing);
        CHECK(grown < 3 * M_PI * 0.25 * kSpacing * kSpacing * gap * kSpacing);
        if (gap > 2) {
            CHECK(cloud::join_pieces(*without, points(gap * kSpacing, false), kSpacing, {}) == 0);
            CHECK(test::identical(*without, *before));
        }
    }
    const double far = 4.5 * kSpacing;
    CHECK(cloud::join_pieces(*body_and_ball(far), points(far, true), kSpacing, {}) == 0);
}

TEST_CASE("join_pieces: pieces that are not small are not joined, however close") {
    const FloatGridPtr two = body_and_ball(kSpacing, 0.4), before = body_and_ball(kSpacing, 0.4);
    CHECK(cloud::join_pieces(*two, points(kSpacing, true), kSpacing, {}) == 0);
    CHECK(test::identical(*two, *before));
}

TEST_CASE("join_pieces: a piece is joined to another one that was joined before") {
    // The body and two small balls in a row. The last one is too far from the body to be joined to it directly.
    const double gap = 1.5 * kSpacing;
    const Vec3 second = ball_center(gap), third{second[0] + 2 * kThin + gap, 0, 0};
    const FloatGridPtr beads = test::start_grid(
        test::cube_domain(80, kVoxel),
        [&](const Vec3& p) {
            return std::min({ball(p, kBody, kRadius), ball(p, second, kThin), ball(p, third, kThin)});
        },
        3 * kVoxel);
    std::vector<Vec3> all = points(gap, true);
    for (double x = second[0]; x < third[0]; x += 0.5 * kSpacing) all.push_back({x, 0, kThin});
    CHECK(cloud::join_pieces(*beads, all, kSpacing, {}) == 2);
    CHECK(measure(extract_mesh(*beads)).components == 1);
}
