#include "covol/orientation.h"

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <set>

#include "covol/error.h"
#include "support/clouds.h"
#include "support/surface_samples.h"

using namespace covol;

namespace {

constexpr double kNoise = 1.0 / 3;  // noise, as a fraction of the points' spacing

RunContext on_threads(int n) {
    RunContext run;
    run.threads = n;
    return run;
}

/// Fraction of the normals that point to the wrong side.
double fraction_wrong(const std::vector<Vec3>& found, const std::vector<Vec3>& truth) {
    std::size_t wrong = 0;
    for (std::size_t n = 0; n < truth.size(); ++n) wrong += !(test::dot(found[n], truth[n]) > 0);
    return double(wrong) / double(truth.size());
}

double mean_cosine(const std::vector<Vec3>& found, const std::vector<Vec3>& truth) {
    double sum = 0;
    for (std::size_t n = 0; n < truth.size(); ++n) sum += test::dot(found[n], truth[n]);
    return sum / double(truth.size());
}

test::SurfaceSample noisy(const test::Solid3& shape, std::size_t count, double spacings, unsigned seed) {
    test::SurfaceSample s = shape.sample(count, seed);
    test::add_noise(s, spacings * s.spacing(), seed + 1000);
    return s;
}

/// A part of the plane z = 0.
test::SurfaceSample patch(std::size_t count, unsigned seed) {
    test::SurfaceSample s;
    s.points = test::box_cloud(int(count), {{-1, -0.7, 0}, {1, 0.7, 1e-12}}, seed);
    s.normals.assign(count, Vec3{0, 0, 1});
    s.area = 2 * 1.4;
    return s;
}

struct Shape {
    const char* name;
    test::Solid3 solid;
    std::size_t count;
};

std::vector<Shape> shapes() {
    return {{"ball", test::ball(1), 2500},
            {"torus", test::torus(1, 0.35), 4000},
            {"shell with a cavity", test::shell(1, 0.5), 4000},
            {"thin plate", test::block({0.8, 0.5, 0.05}), 4000},  // 4 spacings thick
            {"body on thin legs", test::table(0.06), 5000}};      // legs 4 spacings thick
}

}  // namespace

TEST_CASE("measure_cloud_scale: spacing and noise of a plane and a sphere are accurate to 12 %") {
    for (const unsigned seed : {1, 2, 3})
        for (const double spacings : {0.1, kNoise, 0.7})
            for (const bool is_plane : {true, false}) {
                test::SurfaceSample s = is_plane ? patch(4000, seed) : test::ball(1).sample(4000, seed);
                const double spacing = s.spacing();
                test::add_noise(s, spacings * spacing, seed + 10);
                const CloudScale scale = measure_cloud_scale(s.points);
                INFO("seed " << seed << (is_plane ? ", plane" : ", sphere") << ", noise of " << spacings
                             << " spacings; found " << scale.spacing / spacing << " of the spacing, "
                             << scale.noise / (spacings * spacing) << " of the noise");
                CHECK(scale.spacing / spacing == Approx(1).margin(0.12));
                CHECK(scale.noise / (spacings * spacing) == Approx(1).margin(0.1));
            }
}

TEST_CASE("measure_cloud_scale: exact points have hardly any noise, and lengths scale with the unit") {
    const test::SurfaceSample s = test::torus(1, 0.35).sample(4000, 4);
    const CloudScale scale = measure_cloud_scale(s.points);
    CHECK(scale.spacing / s.spacing() == Approx(1).margin(0.12));
    CHECK(scale.noise < 0.03 * s.spacing());
    std::vector<Vec3> larger = s.points;
    for (Vec3& p : larger) p = test::scaled(256, p);
    const CloudScale of_larger = measure_cloud_scale(larger);
    CHECK(of_larger.spacing == Approx(256 * scale.spacing));
    CHECK(of_larger.noise == Approx(256 * scale.noise).margin(1e-6));
}

TEST_CASE("orient: the normals of closed shapes point out of the solid, also into cavities") {
    for (const Shape& shape : shapes())
        for (const auto& [spacings, seed] :
             std::vector<std::pair<double, unsigned>>{{0, 1}, {kNoise, 2}, {kNoise, 3}}) {
            const test::SurfaceSample s = noisy(shape.solid, shape.count, spacings, seed);
            const Orientation o = orient(s.points, measure_cloud_scale(s.points));
            REQUIRE(o.normals.size() == s.points.size());
            REQUIRE(o.areas.size() == s.points.size());
            double area = 0, off_unit = 0;
            for (const double a : o.areas) area += a;
            for (const Vec3& n : o.normals) off_unit = std::max(off_unit, std::abs(test::norm(n) - 1));
            INFO(shape.name << ", noise of " << spacings << " spacings, seed " << seed << ": wrong "
                            << fraction_wrong(o.normals, s.normals) << ", mean cosine "
                            << mean_cosine(o.normals, s.normals) << ", turned " << o.turned << ", area "
                            << area / s.area);
            CHECK(fraction_wrong(o.normals, s.normals) < (spacings > 0 ? 0.007 : 0.001));
            CHECK(mean_cosine(o.normals, s.normals) > (spacings > 0 ? 0.91 : 0.95));
            CHECK(o.turned < 0.004);
            CHECK(area / s.area == Approx(1).margin(0.2));
            CHECK(off_unit < 1e-9);
        }
}

TEST_CASE("orient: the indicator is 1 inside and 0 outside, and its level 1/2 passes near all points") {
    const test::Solid3 shape = test::shell(1, 0.5);
    const test::SurfaceSample s = noisy(shape, 4000, kNoise, 5);
    const Orientation o = orient(s.points, measure_cloud_scale(s.points));
    double worst_in = 0, worst_out = 0;
    for (const Vec3& x : test::box_cloud(2000, {{-1.2, -1.2, -1.2}, {1.2, 1.2, 1.2}}, 6)) {
        if (shape.distance(x) < -0.2) worst_in = std::max(worst_in, std::abs(o.indicator->inside(x) - 1));
        if (shape.distance(x) > 0.2) worst_out = std::max(worst_out, std::abs(o.indicator->inside(x)));
    }
    CHECK(worst_in < 0.2);
    CHECK(worst_out < 0.2);
    double slope = 0;
    for (const Vec3& x : s.points)
        slope -= test::dot(o.indicator->at(x).gradient, test::normal_of(shape.distance, x)) / 4000;
    CHECK(slope > 0.2 / o.indicator->cell());

    std::vector<WorldBox> crossed;
    o.indicator->crossed([&](const WorldBox& box) { crossed.push_back(box); });
    double farthest = 0;
    for (const WorldBox& box : crossed) {
        CHECK(box.max[0] - box.min[0] == Approx(o.indicator->cell()));
        farthest = std::max(farthest, std::abs(shape.distance(test::scaled(0.5, test::sum(box.min, box.max)))));
    }
    CHECK(farthest < 3 * o.indicator->cell());
    for (std::size_t n = 0; n < s.points.size(); n += 10) {
        const Vec3& p = s.points[n];
        CHECK(std::any_of(crossed.begin(), crossed.end(), [&](const WorldBox& box) {
            return test::norm(test::sum(test::scaled(0.5, test::sum(box.min, box.max)), test::scaled(-1, p))) <
                   3 * o.indicator->cell();
        }));
    }
}

TEST_CASE("orient: the normals are bit-identical on any number of threads and in any unit") {
    const test::SurfaceSample s = noisy(test::torus(1, 0.35), 2000, kNoise, 7);
    const CloudOrientation one = orient_cloud(s.points, on_threads(1));
    const CloudOrientation two = orient_cloud(s.points, on_threads(2));
    CHECK(one.points == two.points);
    CHECK(one.scale.spacing == two.scale.spacing);
    CHECK(one.scale.noise == two.scale.noise);
    CHECK(one.orientation.normals == two.orientation.normals);
    CHECK(one.orientation.areas == two.orientation.areas);
    CHECK(one.orientation.turned == two.orientation.turned);

    std::vector<Vec3> larger = one.points;
    for (Vec3& p : larger) p = test::scaled(4096, p);
    const Orientation of_larger = orient(larger, {4096 * one.scale.spacing, 4096 * one.scale.noise});
    CHECK(of_larger.normals == one.orientation.normals);
    CHECK(of_larger.indicator->cell() == Approx(4096 * one.orientation.indicator->cell()));
}

TEST_CASE("orient: repeated points get equal normals, and orient_cloud removes them") {
    const test::SurfaceSample s = noisy(test::torus(1, 0.35), 2000, kNoise, 8);
    std::vector<Vec3> doubled = s.points, normals = s.normals;
    doubled.insert(doubled.end(), s.points.begin(), s.points.end());
    normals.insert(normals.end(), s.normals.begin(), s.normals.end());
    const CloudScale scale = measure_cloud_scale(s.points);
    const Orientation o = orient(doubled, scale);
    CHECK(fraction_wrong(o.normals, normals) < 0.007);
    for (std::size_t n = 0; n < s.points.size(); ++n) REQUIRE(o.normals[n] == o.normals[n + s.points.size()]);
    // Duplicate points of a cloud are removed.
    const CloudOrientation once = orient_cloud(s.points), twice = orient_cloud(doubled);
    CHECK(twice.points == once.points);
    CHECK(twice.orientation.normals == once.orientation.normals);
}

TEST_CASE("orient_cloud: points spread through space are left out, those of a thin plate are kept") {
    for (const Shape& shape : shapes()) {
        if (std::string(shape.name) != "thin plate") continue;
        for (const unsigned seed : {1, 2}) {
            const test::SurfaceSample s = noisy(shape.solid, shape.count, kNoise, seed);
            const std::vector<Vec3> spread =
                test::box_cloud(int(0.03 * double(shape.count)), bounding_box(s.points, 0.3), seed + 7);
            std::vector<Vec3> all = s.points;
            all.insert(all.end(), spread.begin(), spread.end());
            const CloudOrientation cloud = orient_cloud(all);
            const std::set<Vec3> kept(cloud.points.begin(), cloud.points.end());
            CHECK(cloud.points.size() + cloud.stray == all.size());
            CHECK(cloud.orientation.normals.size() == cloud.points.size());
            double lost = 0, far = 0, far_kept = 0;
            for (const Vec3& p : s.points) lost += !kept.count(p);
            for (const Vec3& p : spread) {
                if (std::abs(shape.solid.distance(p)) < 4 * s.spacing())
                    continue;  // points this close to the surface may be kept
                ++far;
                far_kept += kept.count(p);
            }
            INFO(shape.name << ", seed " << seed << ": lost " << lost << " of the surface, kept " << far_kept << " of "
                            << far << " far from it");
            REQUIRE(far > 50);
            CHECK(far_kept < 0.25 * far);
            CHECK(lost < 0.001 * double(shape.count));
            CHECK(cloud.encloses);
            std::vector<Vec3> normals, truth;
            for (std::size_t n = 0, m = 0; n < s.points.size(); ++n) {
                if (!kept.count(s.points[n])) continue;
                REQUIRE(cloud.points[m] == s.points[n]);
                normals.push_back(cloud.orientation.normals[m++]);
                truth.push_back(s.normals[n]);
            }
            CHECK(fraction_wrong(normals, truth) < 0.01);
        }
    }
}

TEST_CASE("orient: clouds without an inside are rejected, and a run can be cancelled") {
    const CloudScale scale{0.1, 0, 0};
    const std::vector<Vec3> three{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, at_one_place(10, Vec3{1, 2, 3});
    for (const auto& points : {std::vector<Vec3>{}, three, at_one_place}) {
        try {
            static_cast<void>(orient(points, scale));
            FAIL("expected an error");
        } catch (const Error& error) {
            CHECK(error.code() == Errc::InvalidInput);
        }
        CHECK_THROWS_AS(orient_cloud(points), Error);
    }
    CHECK_THROWS_AS(orient({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, CloudScale{}), Error);
    CHECK_NOTHROW(orient({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, CloudScale{1, 0, 0}));

    const std::atomic<bool> stop{true};
    RunContext run;
    run.cancel = &stop;
    try {
        static_cast<void>(orient(test::ball(1).sample(500, 9).points, {0.15, 0}, run));
        FAIL("expected an error");
    } catch (const Error& error) {
        CHECK(error.code() == Errc::Cancelled);
    }
}

TEST_CASE("orient: a flat cloud gets unit normals and a finite indicator") {
    const Orientation o = orient(test::box_cloud(500, {{-1, -1, 0}, {1, 1, 1e-300}}, 10), {0.09, 0});
    for (const Vec3& n : o.normals) REQUIRE(test::norm(n) == Approx(1));
    CHECK(std::isfinite(o.indicator->inside({0, 0, 0})));
}
