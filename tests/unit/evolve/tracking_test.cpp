#include "redistance/tracking.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

#include "base/geometry.h"
#include "covol/error.h"
#include "covol/evolve.h"
#include "covol/start.h"
#include "evolve/motion.h"
#include "redistance/redistance.h"
#include "support/clouds.h"

using namespace covol;
using namespace covol::test;

namespace {

constexpr double kH = 0.5, kClamp = 3;
const Domain kDomain = make_domain({{-12, -12, -12}, {12, 9, 12}}, kH);  // the domain's end cuts the second ball

/// The level set of two balls: the signed distance in voxels within `reach` of the surface, multiplied by `scale`.
FloatGridPtr two_balls(double reach, float scale) {
    FloatGridPtr u = make_grid(kDomain, float(scale * reach * kH), "u");
    auto values = u->getAccessor();
    const auto level = [](const Vec3& x) {
        return std::min(std::hypot(x[0] + 4, x[1] + 3, x[2] + 2) - 4.3, std::hypot(x[0] - 4, x[1] - 6, x[2]) - 5.1);
    };
    const openvdb::CoordBBox box({kDomain.min[0], kDomain.min[1], kDomain.min[2]},
                                 {kDomain.max[0], kDomain.max[1], kDomain.max[2]});
    for (auto voxel = box.begin(); voxel; ++voxel) {
        const double d = std::clamp(level(world_of(kDomain, *voxel)), -reach * kH, reach * kH);
        if (std::abs(d) < reach * kH)
            values.setValue(*voxel, scale * float(d));
        else if (d < 0)
            values.setValueOff(*voxel, scale * float(d));
    }
    return u;
}

double clamped(double value) { return std::clamp(value, -kClamp * kH, kClamp * kH); }

struct Difference {
    double largest = 0, crossing = 0;
    int signs = 0, activity = 0;
};

/// Differences of two bands: the maximum difference of values up to the clamp, in voxels; that of the positions at
/// which the surfaces cut voxel edges; the numbers of voxels with different signs, and of voxels active in only one
/// band.
Difference difference(const FloatGrid& one, const FloatGrid& other) {
    Difference result;
    const openvdb::CoordBBox box({kDomain.min[0], kDomain.min[1], kDomain.min[2]},
                                 {kDomain.max[0] - 1, kDomain.max[1] - 1, kDomain.max[2] - 1});
    const auto a = one.getConstAccessor(), b = other.getConstAccessor();
    for (auto voxel = box.begin(); voxel; ++voxel) {
        const float u = a.getValue(*voxel), v = b.getValue(*voxel);
        result.signs += (u < 0) != (v < 0);
        result.activity += a.isValueOn(*voxel) != b.isValueOn(*voxel);
        result.largest = std::max(result.largest, std::abs(clamped(u) - clamped(v)) / kH);
        for (int axis = 0; axis < 3; ++axis) {
            openvdb::Coord next = *voxel;
            ++next[axis];
            const float un = a.getValue(next), vn = b.getValue(next);
            if ((u < 0) != (un < 0) && (v < 0) != (vn < 0))
                result.crossing =
                    std::max(result.crossing, std::abs(double(u) / (double(u) - un) - double(v) / (double(v) - vn)));
        }
    }
    return result;
}

/// A cube of 16^3 voxels. The plane x = kPlane lies midway between two voxels of one leaf.
const Domain kCube = make_domain({{-4, -4, -4}, {4, 4, 4}}, kH);
constexpr double kPlane = 1;

/// A grid with a value at each voxel of kCube, all of them active. @param value  function of x
FloatGridPtr over_cube(const std::function<double(double)>& value, const char* name) {
    FloatGridPtr grid = make_grid(kCube, float(value(kCube.world_box().max[0])), name);
    const openvdb::CoordBBox box({kCube.min[0], kCube.min[1], kCube.min[2]},
                                 {kCube.max[0], kCube.max[1], kCube.max[2]});
    for (auto voxel = box.begin(); voxel; ++voxel)
        grid->tree().setValue(*voxel, float(value(world_of(kCube, *voxel)[0])));
    return grid;
}

/// |grad u| at the plane, in the middle of the cube.
double slope_at_plane(const FloatGrid& u) {
    const openvdb::Coord below(9, 8, 8), above(10, 8, 8);
    REQUIRE(world_of(kCube, below)[0] < kPlane);
    REQUIRE(world_of(kCube, above)[0] > kPlane);
    const double low = u.tree().getValue(below), high = u.tree().getValue(above);
    CHECK(low / (low - high) == Approx(0.5).margin(1e-3));  // the surface has not moved
    return (high - low) / kH;
}

/// u after some steps of a flow with a tracked band, from the distance to the plane.
FloatGridPtr tracked(const EvolveFields& fields, double theta, double delta, int steps) {
    const FloatGridPtr u = over_cube([](double x) { return std::clamp(x - kPlane, -kClamp * kH, kClamp * kH); }, "u");
    EvolveOptions options;
    options.theta = theta;
    options.rho = options.tolerance = 0;
    options.delta = delta;
    options.tau = kH;
    options.follow = true;
    options.max_steps = steps;
    CHECK(evolve(*u, fields, options).steps == steps);
    return u;
}

}  // namespace

TEST_CASE("track_surface: a band of any slope and width agrees with exact distances to first order") {
    const double reach = GENERATE(3.0, 14.0);
    const float scale = GENERATE(1.0F, 0.07F);
    INFO(reach << " voxels, scaled by " << scale);
    const FloatGridPtr before = two_balls(reach, scale), fast = two_balls(reach, scale);
    const FloatGridPtr exact =
        detail::redistance(*before, kDomain, detail::kTrackingWidth, detail::DomainEnd::Open, "u", {});
    detail::track_surface(*fast, kDomain, kClamp);
    const Difference from_exact = difference(*fast, *exact);
    CHECK(from_exact.signs == 0);
    // Neither redistance() nor track_surface() may move the surface. Their results differ only in the groove between
    // the balls.
    CHECK(difference(*fast, *before).crossing <= difference(*exact, *before).crossing);
    CHECK(difference(*exact, *before).crossing < 0.03);
    CHECK(from_exact.largest < 0.25);
    const auto active = double(exact->activeVoxelCount());
    CHECK(from_exact.activity < 0.1 * active);
    CHECK(fast->background() == float(kClamp * kH));
    CHECK(double(fast->tree().leafCount()) <= 1.1 * double(exact->tree().leafCount()));
    for (auto value = fast->cbeginValueOn(); value; ++value)
        for (int a = 0; a < 3; ++a) {
            REQUIRE(value.getCoord()[a] >= kDomain.min[a]);
            REQUIRE(value.getCoord()[a] <= kDomain.max[a]);
        }
}

TEST_CASE("track_free_surface: the surface stays in place, and the band contains the signed distance") {
    const float scale = GENERATE(0.07F, 0.7F, 1.0F, 1.6F, 8.0F);
    const bool is_distance = scale > detail::kFlattest && scale < detail::kSteepest;
    INFO("scaled by " << scale);
    constexpr double kRadius = 16;  // voxels
    const auto level = [](const Vec3& x) { return std::hypot(x[0] + 0.1, x[1] - 0.2, x[2]) - kRadius * kH; };
    const auto made = [&] {
        FloatGridPtr u = make_grid(kDomain, float(scale * 4 * kH), "u");
        const openvdb::CoordBBox box({kDomain.min[0], kDomain.min[1], kDomain.min[2]},
                                     {kDomain.max[0], kDomain.max[1], kDomain.max[2]});
        for (auto voxel = box.begin(); voxel; ++voxel) {
            const double d = std::clamp(level(world_of(kDomain, *voxel)), -4 * kH, 4 * kH);
            u->tree().setValue(*voxel, scale * float(d));
        }
        return u;
    };
    const FloatGridPtr u = made();
    detail::track_free_surface(*u, kDomain, {});
    const Difference moved = difference(*u, *made());
    CHECK(moved.signs == 0);
    CHECK(moved.crossing < (is_distance ? 0.002 : 0.05));
    double maximum = 0;
    for (auto value = u->cbeginValueOn(); value; ++value)
        maximum = std::max(maximum, std::abs(double(*value) - level(world_of(kDomain, value.getCoord()))) / kH);
    CHECK(maximum < 1.0 / kRadius);
    // The values are right also at inactive voxels just beyond the band, which stencils still reach.
    const auto values = u->getConstAccessor();
    const Vec3 beyond = kDomain.world_to_index({-0.1, 0.2, (kRadius + detail::kFreeWidth + 0.6) * kH});
    const openvdb::Coord corner(int(std::lround(beyond[0])), int(std::lround(beyond[1])), int(std::lround(beyond[2])));
    CHECK_FALSE(values.isValueOn(corner));
    CHECK(std::abs(values.getValue(corner) - level(world_of(kDomain, corner))) < kH / kRadius);
}

TEST_CASE("track_free_surface: no leaf of the band lies beyond a face of the domain between two leaves") {
    const FloatGridPtr u = over_cube([](double x) { return x - kPlane; }, "u");
    detail::track_free_surface(*u, kCube, {});
    const openvdb::CoordBBox cube = detail::box_of(kCube);
    REQUIRE(u->tree().leafCount() > 0);
    for (auto leaf = u->tree().cbeginLeaf(); leaf; ++leaf) CHECK(cube.hasOverlap(leaf->getNodeBoundingBox()));
    for (auto voxel = u->cbeginValueOn(); voxel; ++voxel) CHECK(cube.isInside(voxel.getCoord()));
}

TEST_CASE("CrossingMarks: the measured |grad u| of a distance is 1 at planes, and within a fifth of 1 at small balls") {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(-6, 6);
    detail::LeafMask all;
    all.fill(~std::uint64_t(0));
    std::vector<float> u(detail::kLeafSize);
    const double radius = GENERATE(1e6, 30.0, 8.0);
    // Across a leaf with a small ball, the mean of the components along an axis is larger than that of one normal.
    const double tolerance = radius > 1e5 ? 0.01 : radius > 20 ? 0.04 : 0.2;
    double lowest = 1, highest = 1;
    for (int n = 0; n < 2000; ++n) {
        const Vec3 direction = unit({normal(random), normal(random), normal(random)});
        Vec3 at{3.5, 3.5, 3.5};  // a position on the surface
        for (double& x : at) x += uniform(random);
        for (int v = 0; v < detail::kLeafSize; ++v) {
            const Vec3 to = minus({double(v >> 6), double(v >> 3 & 7), double(v & 7)}, at);
            const double along = dot(to, direction), square = dot(to, to);
            // The distance from a ball that touches the plane at `at`, without the cancellation of a large radius.
            u[v] = float((2 * radius * along + square) /
                         (std::sqrt(radius * radius + 2 * radius * along + square) + radius));
        }
        detail::CrossingMarks marks;
        marks.resize(1);
        const double slope = marks.renew(0, u.data(), all).slope;
        lowest = std::min(lowest, slope);
        highest = std::max(highest, slope);
    }
    INFO("radius " << radius << ": " << lowest << " to " << highest);
    CHECK(lowest > 1 - tolerance);
    CHECK(highest < 1 + tolerance);
    CHECK(highest > lowest);
}

// The band is examined in each third step.
TEST_CASE("A free band is rebuilt if |grad u| on its surface is below 1/2 or above 2, otherwise it stays as it is") {
    const double slope = GENERATE(0.25, 0.6, 1.7, 8.0);
    INFO("slope " << slope);
    // An obstacle and a floor with the same values hold u to them, so that the slope changes, but the surface does not
    // move.
    const FloatGridPtr held = over_cube([&](double x) { return slope * (x - kPlane); }, "obstacle");
    EvolveFields fields;
    fields.obstacle = fields.floor = held.get();
    CHECK(slope_at_plane(*tracked(fields, 0, kH, 2)) == Approx(slope));
    const FloatGridPtr u = tracked(fields, 0, kH, 3);
    const bool is_rebuilt = slope < detail::kFlattest || slope > detail::kSteepest;
    CHECK(slope_at_plane(*u) == Approx(is_rebuilt ? 1 : slope).margin(1e-3));
    double maximum = 0;
    for (auto value = u->cbeginValueOn(); value; ++value) {
        const double x = world_of(kCube, value.getCoord())[0];
        maximum = std::max(maximum, std::abs(double(*value) - (is_rebuilt ? 1 : slope) * (x - kPlane)) / kH);
    }
    CHECK(maximum < 0.1);
}

TEST_CASE("The level set of a surface held by points is redistanced once |grad u| on it is above 2") {
    const FloatGridPtr distance = over_cube([](double x) { return std::abs(x - kPlane); }, "distance");
    EvolveFields fields;
    fields.distance = distance.get();
    CHECK(slope_at_plane(*tracked(fields, 1, 0, 2)) > detail::kSteepest);
    CHECK(slope_at_plane(*tracked(fields, 1, 0, 3)) == Approx(1).margin(0.05));
}

TEST_CASE("track_surface: a level set without a surface is rejected and unchanged") {
    FloatGridPtr u = make_grid(kDomain, 1.5F, "u");
    u->tree().setValue({3, 4, 5}, 0.7F);
    const FloatGridPtr before = u->deepCopy();
    CHECK_THROWS_AS(detail::track_surface(*u, kDomain, kClamp), Error);
    CHECK(identical(*u, *before));
}
