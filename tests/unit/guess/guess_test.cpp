#include "covol/guess.h"

#include <catch2/catch.hpp>
#include <numbers>

#include "covol/error.h"
#include "covol/mesh.h"
#include "covol/surface.h"
#include "support/clouds.h"
#include "support/shapes.h"

using namespace covol;
using namespace covol::test;

namespace {

constexpr double kPi = std::numbers::pi;

/// A closed surface with a known volume and a signed distance that is exact to first order near it.
struct Shape {
    const char* name;
    std::function<Vec3(std::mt19937&)> draw;  ///< a random point of the surface
    Function distance;
    double volume;
    double bias_of_50 = 0.05,
           volume_of_50 = 0.005;  ///< tolerances for 50 points, whose gaps are as wide as the ring is thick
};

Vec3 random_direction(std::mt19937& random) {
    std::normal_distribution<double> normal;
    const Vec3 v{normal(random), normal(random), normal(random)};
    const double l = length(v);
    return {v[0] / l, v[1] / l, v[2] / l};
}

Shape ellipsoid(const char* name, const Vec3& r) {
    const auto level = [r](const Vec3& x) { return length({x[0] / r[0], x[1] / r[1], x[2] / r[2]}); };
    return {name,
            [r](std::mt19937& random) {
                const Vec3 d = random_direction(random);
                return Vec3{r[0] * d[0], r[1] * d[1], r[2] * d[2]};
            },
            [r, level](const Vec3& x) {
                const double l = level(x);
                return l * (l - 1) / length({x[0] / (r[0] * r[0]), x[1] / (r[1] * r[1]), x[2] / (r[2] * r[2])});
            },
            4.0 / 3 * kPi * r[0] * r[1] * r[2],
            r[0] == r[2] ? 0.05 : 0.2,
            r[0] == r[2] ? 0.005 : 0.03};
}

Shape torus(double R, double r) {
    return {"torus",
            [R, r](std::mt19937& random) {
                std::uniform_real_distribution<double> angle(0, 2 * kPi), fraction(0, R + r);
                for (;;) {
                    const double u = angle(random), v = angle(random), ring = R + r * std::cos(v);
                    if (fraction(random) < ring) return Vec3{ring * std::cos(u), ring * std::sin(u), r * std::sin(v)};
                }
            },
            [R, r](const Vec3& x) { return std::hypot(std::hypot(x[0], x[1]) - R, x[2]) - r; },
            2 * kPi * kPi * R * r * r,
            0.7,
            0.12};
}

std::vector<Vec3> draw(const Shape& shape, int count, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<Vec3> points;
    for (int n = 0; n < count; ++n) points.push_back(shape.draw(random));
    return points;
}

GuessOptions options_of_precision(const Vec3& spacing, double fraction = 0.3) {
    GuessOptions options;
    for (int a = 0; a < 3; ++a) options.deviation[a][a] = fraction * spacing[a];
    return options;
}

struct Bias {
    double mean, volume;
};

Bias bias_of(const Shape& shape, const std::vector<Vec3>& marks, const GuessOptions& options) {
    const Domain domain = cube_domain(80, 1.0);
    const FloatGridPtr guess = guess_from_marks(domain, marks, options).u;
    const TriangleMesh mesh = extract_mesh(*extract_surface(*guess), {});
    double sum = 0;
    for (const auto& v : mesh.vertices) sum += shape.distance({v[0], v[1], v[2]});
    return {sum / double(mesh.vertices.size()), measure(mesh).volume / shape.volume};
}

}  // namespace

TEST_CASE("Exact marks are interpolated without bias, however few they are") {
    const Shape shapes[] = {ellipsoid("sphere", {20, 20, 20}), ellipsoid("ellipsoid", {28, 18, 14}), torus(24, 11)};
    for (const Vec3& spacing : {Vec3{1, 1, 1}, Vec3{1, 1, 5}})
        for (const Shape& shape : shapes)
            for (const int count : {50, 300, 3000})
                for (const unsigned seed : {1u, 2u}) {
                    if (count == 3000 && seed > 1) continue;
                    const Bias bias = bias_of(shape, draw(shape, count, seed), options_of_precision(spacing));
                    INFO(shape.name << ", " << count << " points, seed " << seed << ", spacing " << spacing[2]
                                    << ": mean " << bias.mean << " voxels, volume " << bias.volume);
                    CHECK(std::abs(bias.mean) <= (count == 50 ? shape.bias_of_50 : 0.02));
                    CHECK(std::abs(bias.volume - 1) <= (count == 50 ? shape.volume_of_50 : 0.005));
                }
}

TEST_CASE("Twenty marks along most of a ring enclose about the volume of its tube") {
    // With initial normals from the centre and from the ten nearest marks only, the surface also fills the ring: up to
    // ten times the volume.
    constexpr double kRing = 3, kTube = 0.5, kAngle = 5;
    constexpr double kVolume = kPi * kTube * kTube * kRing * kAngle + 4.0 / 3 * kPi * kTube * kTube * kTube;
    for (unsigned seed = 0; seed < 6; ++seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> uniform;
        std::vector<Vec3> marks;
        for (int n = 0; n < 20; ++n) {
            const double along = (n + uniform(random)) / 20 * kAngle, around = 2 * kPi * uniform(random),
                         ring = kRing + kTube * std::cos(around);
            marks.push_back({ring * std::cos(along), ring * std::sin(along), kTube * std::sin(around)});
        }
        const Domain domain = make_domain({{-5, -5, -2.5}, {5, 5, 2.5}}, 0.15);
        const Guess guess = guess_from_marks(domain, marks, {});
        const double volume = measure(extract_mesh(*extract_surface(*guess.u), {})).volume / kVolume;
        INFO("seed " << seed << ": volume " << volume);
        CHECK(volume > 0.6);
        CHECK(volume < 1.4);
    }
}

TEST_CASE("Inaccurate marks in thick slices enclose a body of half to twice the true volume") {
    // The marks are scattered, so that the body is bumpy. By bending energy alone, many surfaces through such marks run
    // to infinity and do not close.
    const Shape shape = ellipsoid("ellipsoid", {18, 13, 16});
    const Vec3 spacing{0.8, 0.8, 6.5};
    int held = 0;
    for (const int count : {20, 60})
        for (unsigned seed = 1; seed <= 12; ++seed) {
            std::vector<Vec3> marks = draw(shape, count, seed);
            std::mt19937 random(seed);
            std::uniform_real_distribution<double> off(-0.5, 0.5), factor(0.75, 1.25);
            for (Vec3& mark : marks) {
                const double times = factor(random);
                for (int a = 0; a < 3; ++a) mark[a] = times * mark[a] + off(random) * spacing[a];
            }
            const Guess guess = guess_from_marks(cube_domain(120, 1.0), marks, options_of_precision(spacing));
            const double volume = measure(extract_mesh(*extract_surface(*guess.u), {})).volume / shape.volume;
            held += guess.report.held_around;
            INFO(count << " marks, seed " << seed << ": volume " << volume << ", held " << guess.report.held_around);
            CHECK(volume > 0.5);
            CHECK(volume < 2);
        }
    CHECK(held > 0);
}

TEST_CASE("Marks that enclose nothing are rejected with a reason") {
    const Domain domain = cube_domain(40, 1.0);
    const auto guess = [&](const std::vector<Vec3>& marks) {
        return guess_from_marks(domain, marks, options_of_precision({1, 1, 1})).u;
    };
    CHECK_THROWS_WITH(guess({{0, 0, 0}, {5, 0, 0}, {0, 5, 0}}), Catch::Contains("at least 4 marks"));
    std::vector<Vec3> ring;
    for (int n = 0; n < 20; ++n) ring.push_back({10 * std::cos(0.3 * n), 10 * std::sin(0.3 * n), 2});
    CHECK_THROWS_WITH(guess(ring), Catch::Contains("second slice"));
}

TEST_CASE("The guess is bit-identical for 1 and 4 threads") {
    const Shape shape = ellipsoid("ellipsoid", {18, 12, 10});
    const Domain domain = cube_domain(56, 1.0);
    const std::vector<Vec3> marks = draw(shape, 500, 5);  // so many that the surface is computed in patches
    RunContext one, four;
    one.threads = 1;
    four.threads = 4;
    const Guess a = guess_from_marks(domain, marks, options_of_precision({1, 1, 1}), one);
    const Guess b = guess_from_marks(domain, marks, options_of_precision({1, 1, 1}), four);
    CHECK(a.report.patches > 0);
    CHECK(identical(*a.u, *b.u));
}

TEST_CASE("Marks in the cut are distinguished from marks on the surface") {
    // A ball whose upper third is beyond the end of the image, with marks on its surface and on the cut.
    const Shape shape = ellipsoid("sphere", {20, 20, 20});
    Domain domain = cube_domain(72, 1.0);
    domain.max[2] = domain.min[2] + 41;
    GuessOptions options = options_of_precision({1, 1, 1});
    options.end = domain.world_box();
    const double top = options.end->max[2];
    std::vector<Vec3> marks;
    for (const Vec3& p : draw(shape, 300, 7))
        if (p[2] < top) marks.push_back(p);
    const std::size_t on_surface = marks.size();
    const double rim = std::sqrt(400 - top * top);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> along(-rim, rim);
    while (marks.size() < on_surface + 60) {
        const Vec3 p{along(random), along(random), top - 0.5};
        if (std::hypot(p[0], p[1]) < 0.8 * rim) marks.push_back(p);
    }
    const auto [guess, kept, report] = guess_from_marks(domain, marks, options);
    CHECK(report.cut_marks == 60);
    double sum = 0;
    int count = 0;
    for (const auto& v : extract_mesh(*extract_surface(*guess), {}).vertices)
        if (v[2] < top - 1) sum += shape.distance({v[0], v[1], v[2]}), ++count;
    CHECK(std::abs(sum / count) < 0.03);
}

TEST_CASE("An outside seed in a cavity keeps the cavity open") {
    // A thick shell with marks on both walls. Without a seed, the cavity may be taken for part of the body.
    std::vector<Vec3> marks = draw(ellipsoid("outer", {22, 22, 22}), 120, 11);
    const std::vector<Vec3> inner = draw(ellipsoid("inner", {10, 10, 10}), 40, 12);
    marks.insert(marks.end(), inner.begin(), inner.end());
    const Domain domain = cube_domain(64, 1.0);
    GuessOptions options = options_of_precision({1, 1, 1});
    options.outside = {{0, 0, 0}};
    options.inside = {{16, 0, 0}, {0, -16, 0}};
    const auto [guess, kept, report] = guess_from_marks(domain, marks, options);
    CHECK(report.wrong_seeds == 0);
    CHECK(value_at(*guess, {0, 0, 0}) > 0);
    CHECK(value_at(*guess, {0, 16, 0}) < 0);
    CHECK(value_at(*guess, {0, 0, 28}) > 0);
    const MeshMeasures measures = measure(extract_mesh(*extract_surface(*guess), {}));
    CHECK(measures.volume == Approx(4.0 / 3 * kPi * (22 * 22 * 22 - 1000)).epsilon(0.03));
}
