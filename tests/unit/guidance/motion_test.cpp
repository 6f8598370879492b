#include "covol/motion.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

#include "covol/compare.h"
#include "covol/domain.h"
#include "covol/segment_structures.h"
#include "covol/start.h"

using namespace covol;

namespace {

constexpr int kSize = 44;
const Vec3 kMiddle{21.3, 22.1, 20.7};

/// The level set of a body without symmetry, an ellipsoid with a bump. @param grown  how far its surface is moved
/// outward, voxels
double level(const Vec3& p, const Vec3& shift, double grown) {
    Vec3 q;
    for (int a = 0; a < 3; ++a) q[a] = p[a] - kMiddle[a] - shift[a];
    const double body = (std::sqrt(q[0] * q[0] / 1.3 + q[1] * q[1] / 0.9 + q[2] * q[2]) - 9);
    const double bump = std::hypot(q[0] - 7, q[1] - 5, q[2] - 2) - 4;
    return std::min(body, bump) - grown;
}

struct Appearance {
    Vec3 shift{0, 0, 0};
    double grown = 0, gain = 100, base = 20, noise = 0;
};

Image frame(const Appearance& look) {
    ImageGeometry geometry;
    geometry.size = {kSize, kSize, kSize};
    std::mt19937_64 random(11);
    std::normal_distribution<double> normal;
    std::vector<float> values;
    for (int k = 0; k < kSize; ++k)
        for (int j = 0; j < kSize; ++j)
            for (int i = 0; i < kSize; ++i) {
                const double d = level({double(i), double(j), double(k)}, look.shift, look.grown);
                // The brightness has gradients of its own within the body and around it.
                const double inside = 1 + 0.02 * i, outside = 0.01 * j;
                const double edge = 1 / (1 + std::exp(d / 0.7));
                values.push_back(
                    float(look.base + look.gain * (outside + (inside - outside) * edge + look.noise * normal(random))));
            }
    return Image::from_values(geometry, values.data());
}

FloatGridPtr body(const Appearance& look = {}) {
    Domain domain;
    domain.max = {kSize - 1, kSize - 1, kSize - 1};
    return start_from_level(domain, {{kMiddle[0], kMiddle[1], kMiddle[2] + 9}},
                            [&](const Vec3& from, const Vec3& step, int count, double* values) {
                                for (int n = 0; n < count; ++n)
                                    values[n] =
                                        level({from[0] + n * step[0], from[1] + n * step[1], from[2] + n * step[2]},
                                              look.shift, look.grown);
                            });
}

CompareReport compare_level_sets(const FloatGridPtr& one, const FloatGridPtr& other) {
    Solid a, b;
    a.level_set = one;
    b.level_set = other;
    return compare(a, b);
}

}  // namespace

TEST_CASE("A surface stays in place if the image does not change") {
    const double noise = GENERATE(0.0, 0.1);
    const Appearance look{.noise = noise};
    const FloatGridPtr before = body();
    const Followed followed = SurfaceTemplate(before, frame(look)).follow(frame(look));
    CHECK(followed.report.max_offset < 1e-3);
    CHECK(followed.report.translation == Vec3{0, 0, 0});
    CHECK(followed.report.correlation == Approx(1));
    CHECK(followed.u == before);
}

TEST_CASE("A surface follows a body that moves and grows while gain and offset of the image change") {
    const Appearance then{.noise = 0.03};
    Appearance now{.shift = {3.2, -1.6, 0.7}, .gain = 60, .base = 90, .noise = 0.03};
    now.grown = GENERATE(0.0, 1.0);
    const FloatGridPtr before = body();
    const Followed followed = SurfaceTemplate(before, frame(then)).follow(frame(now));
    for (int a = 0; a < 3; ++a) CHECK(followed.report.translation[a] == Approx(now.shift[a]).margin(0.3));
    CHECK(followed.report.mean_offset == Approx(now.grown).margin(0.3));
    CHECK(followed.report.correlation > 0.9);
    CHECK(compare_level_sets(followed.u, body(now)).assd < 0.3);
    CHECK(compare_level_sets(before, body(now)).assd > 1.2);  // the error if the surface did not follow
}

TEST_CASE("The followed surface does not depend on the number of threads") {
    const Image then = frame({}), now = frame({.shift = {1, 0, 0}, .grown = 0.5, .noise = 0.05});
    std::vector<FloatGridPtr> found;
    for (const int threads : {1, 3}) {
        RunContext run;
        run.threads = threads;
        found.push_back(SurfaceTemplate(body(), then, run).follow(now, run).u);
    }
    REQUIRE(found[0]->tree().hasSameTopology(found[1]->tree()));
    for (auto value = found[0]->cbeginValueOn(); value; ++value)
        REQUIRE(*value == found[1]->tree().getValue(value.getCoord()));
}

TEST_CASE("In a static time-lapse the surface moves by less than a tenth of a voxel over ten frames") {
    Marks marks;
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    while (marks.points.size() < 60) {  // random directions from the middle of the body
        Vec3 d{normal(random), normal(random), normal(random)};
        const double length = std::hypot(d[0], d[1], d[2]);
        double low = 0, high = 20;
        for (int step = 0; step < 40; ++step) {
            const double t = 0.5 * (low + high);
            Vec3 p;
            for (int a = 0; a < 3; ++a) p[a] = kMiddle[a] + t * d[a] / length;
            (level(p, {0, 0, 0}, 0) < 0 ? low : high) = t;
        }
        Vec3 p;
        for (int a = 0; a < 3; ++a) p[a] = kMiddle[a] + low * d[a] / length;
        marks.points.push_back(p);
    }
    const Image still = frame({.noise = 0.03});
    TimeLapse lapse;
    const FloatGridPtr first = lapse.segment(still, {marks}).structures.at(0).result.surface;
    CHECK(compare_level_sets(first, body()).assd < 0.5);
    StructuresResult last;
    for (int n = 1; n < 10; ++n) last = lapse.segment(still, {Marks{}});
    CHECK(compare_level_sets(first, last.structures.at(0).result.surface).hausdorff < 0.1);
    REQUIRE(last.structures.at(0).motion);
    CHECK(last.structures.at(0).result.report.solve.steps == 0);
}
