// Orientation by normals or sensor positions that files contain.
#include "cloud/orientation/given_sides.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <set>

#include "covol/cloud_surface.h"
#include "covol/error.h"
#include "support/clouds.h"
#include "support/surface_samples.h"

using namespace covol;

namespace {

test::SurfaceSample noisy(const test::Solid3& shape, std::size_t count, double spacings, unsigned seed) {
    test::SurfaceSample s = shape.sample(count, seed);
    test::add_noise(s, spacings * s.spacing(), seed + 100);
    return s;
}

std::vector<Vec3> flipped(std::vector<Vec3> normals, double fraction, unsigned seed) {
    std::mt19937 random(seed);
    for (Vec3& n : normals)
        if (random() < fraction * 4294967296.0) n = test::scaled(-1, n);
    return normals;
}

std::vector<Vec3> random_normals(std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::vector<Vec3> all;
    while (all.size() < count) all.push_back(test::unit({normal(random), normal(random), normal(random)}));
    return all;
}

double fraction_wrong(const std::vector<Vec3>& found, const std::vector<Vec3>& truth) {
    std::size_t wrong = 0;
    for (std::size_t n = 0; n < truth.size(); ++n) wrong += !(test::dot(found[n], truth[n]) > 0);
    return double(wrong) / double(truth.size());
}

CloudOrientation with_normals(const std::vector<Vec3>& points, const std::vector<Vec3>& normals) {
    return orient_cloud(points, PointHints{normals, {}});
}

std::vector<Vec3> towards(const Vec3& sensor, const std::vector<Vec3>& points) {
    std::vector<Vec3> all;
    for (const Vec3& p : points) all.push_back(test::unit(test::sum(sensor, test::scaled(-1, p))));
    return all;
}

}  // namespace

TEST_CASE("Given normals: correct ones are used, flipped ones are repaired, and inward ones are reversed") {
    for (const test::Solid3& shape :
         {test::ball(1), test::torus(1, 0.35), test::table(0.07), test::block({0.7, 0.7, 0.05})})
        for (unsigned seed = 1; seed <= 2; ++seed) {
            const test::SurfaceSample s = noisy(shape, 5000, 0.3, seed);
            const CloudOrientation good = with_normals(s.points, s.normals);
            REQUIRE(good.points == s.points);
            CHECK(good.hints.used);
            CHECK(good.hints.normals == s.points.size());
            CHECK(good.hints.agree > 0.99);
            CHECK_FALSE(good.hints.inward);
            CHECK(fraction_wrong(good.orientation.normals, s.normals) < 0.005);

            const CloudOrientation mended = with_normals(s.points, flipped(s.normals, 0.2, seed));
            CHECK(mended.hints.used);
            CHECK(mended.hints.agree == Approx(0.8).margin(0.03));
            CHECK(fraction_wrong(mended.orientation.normals, s.normals) < 0.01);

            const CloudOrientation inward = with_normals(s.points, flipped(s.normals, 1, seed));
            CHECK(inward.hints.used);
            CHECK(inward.hints.inward);
            CHECK(inward.orientation.normals == good.orientation.normals);
        }
}

TEST_CASE("Given normals: random, half-flipped, parallel or few normals are ignored") {
    const test::SurfaceSample s = noisy(test::torus(1, 0.35), 4000, 0.3, 3);
    const CloudOrientation own = orient_cloud(s.points);
    const std::vector<Vec3> random = random_normals(s.points.size(), 5), half = flipped(s.normals, 0.5, 6),
                            up(s.points.size(), Vec3{0, 0, 1});
    for (const auto& normals : {random, half, up}) {
        const CloudOrientation cloud = with_normals(s.points, normals);
        CHECK_FALSE(cloud.hints.used);
        CHECK_FALSE(cloud.hints.why_not.empty());
        CHECK(cloud.orientation.normals == own.orientation.normals);
        CHECK(cloud.hints.agree == Approx(0.5).margin(0.06));
    }
    // Only a quarter of the points have normals, which are too few to use.
    std::vector<Vec3> few(s.points.size(), Vec3{0, 0, 0});
    for (std::size_t n = 0; n < few.size(); n += 4) few[n] = s.normals[n];
    const CloudOrientation cloud = with_normals(s.points, few);
    CHECK_FALSE(cloud.hints.used);
    CHECK(cloud.orientation.normals == own.orientation.normals);
}

TEST_CASE("Given normals: a part that is reversed as a whole is detected from the points alone") {
    for (const test::Solid3& shape : {test::torus(1, 0.35), test::table(0.07)}) {
        const test::SurfaceSample s = noisy(shape, 6000, 0.2, 4);
        std::vector<Vec3> normals = s.normals;
        std::size_t turned = 0;
        for (std::size_t n = 0; n < normals.size(); ++n)
            if (s.points[n][0] > 0.45) {
                normals[n] = test::scaled(-1, normals[n]);
                ++turned;
            }
        REQUIRE(double(turned) > 0.05 * double(normals.size()));
        const CloudOrientation cloud = with_normals(s.points, normals);
        CHECK_FALSE(cloud.hints.used);
        CHECK(fraction_wrong(cloud.orientation.normals, s.normals) < 0.01);
        // The cross-validation with one half of the normals against the other does not detect the error, because both
        // halves contain it.
        CHECK(cloud.hints.predicted > 0.9);
    }
}

TEST_CASE("Given normals: a point without a normal is oriented as its neighbours") {
    const test::SurfaceSample s = noisy(test::ball(1), 4000, 0.2, 5);
    std::vector<Vec3> normals = s.normals;
    for (std::size_t n = 0; n < normals.size(); n += 3) normals[n] = {0, 0, 0};
    const CloudOrientation cloud = with_normals(s.points, normals);
    CHECK(cloud.hints.used);
    CHECK(cloud.hints.normals < s.points.size());
    CHECK(fraction_wrong(cloud.orientation.normals, s.normals) < 0.001);
}

TEST_CASE("Sensor position: it orients the points that it sees, and is ignored if it cannot have seen them all") {
    const test::SurfaceSample s = noisy(test::ball(1), 9000, 0.2, 6);
    const Vec3 sensor{0, 0, 6};
    test::SurfaceSample seen;
    for (std::size_t n = 0; n < s.points.size(); ++n)
        if (test::dot(s.normals[n], test::sum(sensor, test::scaled(-1, s.points[n]))) > 0.3) {
            seen.points.push_back(s.points[n]);
            seen.normals.push_back(s.normals[n]);
        }
    const CloudOrientation cloud = orient_cloud(seen.points, PointHints{{}, towards(sensor, seen.points)});
    CHECK(cloud.hints.used);
    CHECK(cloud.hints.from_sensor);
    CHECK(cloud.hints.sensors == seen.points.size());
    CHECK(fraction_wrong(cloud.orientation.normals, seen.normals) < 0.002);
    // At least half of a closed ball is hidden from any position outside it, so the sensor cannot have seen all points.
    const CloudOrientation whole = orient_cloud(s.points, PointHints{{}, towards(sensor, s.points)});
    CHECK_FALSE(whole.hints.used);
    CHECK(fraction_wrong(whole.orientation.normals, s.normals) < 0.001);
}

TEST_CASE("Given normals: points within the union of touching or overlapping boxes are left out") {
    const test::Solid3 box = test::block({0.5, 0.5, 0.5});
    for (const double shift : {1.0, 0.6}) {  // side by side, and overlapping
        const Vec3 by{shift, shift == 1.0 ? 0 : 0.3, 0};
        std::vector<Vec3> points, normals, within;
        for (const unsigned seed : {1U, 2U}) {
            const test::SurfaceSample s = box.sample(6000, seed);
            for (std::size_t n = 0; n < s.points.size(); ++n) {
                const Vec3 p = seed == 1 ? s.points[n] : test::sum(s.points[n], by);
                points.push_back(p);
                normals.push_back(s.normals[n]);
                const double in_other = box.distance(seed == 1 ? test::sum(p, test::scaled(-1, by)) : p);
                // Points near the rim of the common wall are not counted, because the outer surface is close to them.
                const bool is_near_rim = std::max(std::abs(p[1]), std::abs(p[2])) > 0.4;
                if (shift == 1.0 ? in_other < 1e-3 && !is_near_rim : in_other < -0.1) within.push_back(p);
            }
        }
        const CloudOrientation cloud = with_normals(points, normals);
        CHECK(cloud.hints.used);
        CHECK(cloud.points.size() + cloud.enclosed == points.size());
        REQUIRE(within.size() > 300);
        const std::set<Vec3> kept(cloud.points.begin(), cloud.points.end());
        const auto left = std::count_if(within.begin(), within.end(), [&](const Vec3& p) { return kept.count(p) > 0; });
        INFO("shift " << shift << ": " << left << " of " << within.size() << " within are left, " << cloud.enclosed
                      << " left out");
        // Where walls of the two boxes touch, some points within the joint solid are kept if one of the walls is
        // sampled more densely than the other.
        CHECK(double(left) < 0.3 * double(within.size()));
        CHECK(double(cloud.enclosed) < 1.6 * double(within.size()));
    }
    // Two boxes with a gap of 0.1, about three spacings, must not be joined to one solid: no point may be left out.
    std::vector<Vec3> points, normals;
    for (const double side : {0.0, 1.1}) {
        const test::SurfaceSample s = box.sample(6000, 3);  // with a spacing of 0.032
        for (std::size_t n = 0; n < s.points.size(); ++n) {
            points.push_back(test::sum(s.points[n], {side, 0, 0}));
            normals.push_back(s.normals[n]);
        }
    }
    CHECK(with_normals(points, normals).enclosed == 0);
}

TEST_CASE("carried: hints are assigned to the nearest points, and a wrong number of hints is rejected") {
    const std::vector<Vec3> from{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 0, 0}};
    const PointHints hints{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}}, {}};
    const PointHints left = carried(hints, from, {{2.1, 0, 0}, {1, 0, 0}});
    CHECK(left.normals == std::vector<Vec3>{{0, 0, 1}, {0, 1, 0}});
    CHECK(left.to_sensor.empty());
    CHECK(carried({}, from, from).normals.empty());
    CHECK_THROWS_AS(carried(PointHints{{{1, 0, 0}}, {}}, from, from), Error);
}

TEST_CASE("Given normals: the orientation is bit-identical on any number of threads") {
    const test::SurfaceSample s = noisy(test::torus(1, 0.35), 3000, 1, 7);
    const PointHints hints{flipped(s.normals, 0.1, 8), {}};
    RunContext one, two;
    one.threads = 1;
    two.threads = 2;
    const CloudOrientation a = orient_cloud(s.points, hints, one), b = orient_cloud(s.points, hints, two);
    CHECK(a.orientation.normals == b.orientation.normals);
    CHECK(a.hints.agree == b.hints.agree);
    CHECK(a.hints.used == b.hints.used);
}
