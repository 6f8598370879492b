#include "covol/guidance.h"

#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <functional>
#include <random>

#include "covol/domain.h"
#include "covol/error.h"
#include "covol/guess.h"
#include "covol/start.h"
#include "covol/surface.h"
#include "support/shapes.h"

using namespace covol;
using covol::test::length;

namespace {

constexpr int kSize = 56;
constexpr double kRadius = 14;

/// The geometry of an image centred on the origin, whose voxels have edges of 1, but of `along_z` along z.
ImageGeometry lattice(double along_z = 1) {
    ImageGeometry g;
    g.size = {kSize, kSize, std::int32_t(std::lround(kSize / along_z))};
    g.spacing = {1, 1, along_z};
    for (int a = 0; a < 3; ++a) g.origin[a] = -0.5 * (g.size[a] - 1) * g.spacing[a];
    return g;
}

/// An image with the brightness of a position, plus Gaussian noise.
Image picture(const ImageGeometry& g, const std::function<double(const Vec3&)>& brightness, double noise,
              unsigned seed = 1) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, noise > 0 ? noise : 1);
    std::vector<float> values;
    for (int k = 0; k < g.size[2]; ++k)
        for (int j = 0; j < g.size[1]; ++j)
            for (int i = 0; i < g.size[0]; ++i)
                values.push_back(float(brightness(g.index_to_world({double(i), double(j), double(k)})) +
                                       (noise > 0 ? normal(random) : 0.0)));
    return Image::from_values(g, values.data());
}

/// A step from 0 inside to 1 outside, over about a voxel.
double step_at(double signed_distance) { return 0.5 * (1 + std::tanh(2 * signed_distance)); }

/// Marks that are spread evenly on a sphere, each moved by up to `jitter` along each axis.
std::vector<Vec3> marks_on_sphere(int count, double radius, double jitter = 0.5, unsigned seed = 7) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-jitter, jitter);
    std::vector<Vec3> marks;
    const double golden = M_PI * (3 - std::sqrt(5.0));
    for (int n = 0; n < count; ++n) {
        const double z = 1 - (2 * n + 1.0) / count, r = std::sqrt(1 - z * z);
        Vec3 mark{radius * r * std::cos(golden * n), radius * r * std::sin(golden * n), radius * z};
        if (jitter > 0)
            for (double& x : mark) x += uniform(random);
        marks.push_back(mark);
    }
    return marks;
}

Domain domain_of_image(const ImageGeometry& g) { return make_domain(g.world_box(), 1.0); }

/// A level set from a function that is negative inside.
FloatGridPtr level_set(const Domain& d, const std::function<double(const Vec3&)>& f) {
    FloatGridPtr grid = make_grid(d, 3.0F, "guess");
    auto accessor = grid->getAccessor();
    test::for_each_voxel(d, [&](int i, int j, int k, const Vec3& x) {
        accessor.setValue(test::coord(d, i, j, k), float(std::clamp(f(x), -3.0, 3.0)));
    });
    return start_from_grid(d, *grid);
}

struct Radius {
    double mean, rms, largest;
};

/// The mean, root mean square and largest absolute value of |x| - `radius` over the vertices x of the surface.
Radius radius_of(const FloatGrid& grid, double radius) {
    const TriangleMesh mesh = extract_mesh(*extract_surface(grid));
    Radius r{0, 0, 0};
    for (const auto& v : mesh.vertices) {
        const double off = length({v[0], v[1], v[2]}) - radius;
        r.mean += off / double(mesh.vertices.size());
        r.rms += off * off / double(mesh.vertices.size());
        r.largest = std::max(r.largest, std::abs(off));
    }
    r.rms = std::sqrt(r.rms);
    return r;
}

/// A sphere through the marks with dents and bumps between them, of amplitude `depth` at the positions farthest from
/// marks.
FloatGridPtr wavy_sphere(const Domain& d, const std::vector<Vec3>& marks, double depth) {
    double farthest = 0;
    const auto to_mark = [&](const Vec3& x) {
        double nearest = 1e300;
        for (const Vec3& m : marks) nearest = std::min(nearest, test::distance(x, m));
        return nearest;
    };
    for (const Vec3& x : marks_on_sphere(2000, kRadius, 0)) farthest = std::max(farthest, to_mark(x));
    return level_set(d, [&](const Vec3& x) {
        const double r = std::max(length(x), 1e-6);
        const Vec3 foot{x[0] * kRadius / r, x[1] * kRadius / r, x[2] * kRadius / r};
        const double fraction = std::min(to_mark(foot) / farthest, 1.0);
        const double sign = foot[0] > 0 ? 1 : -1;
        return r - kRadius - sign * depth * fraction * fraction;
    });
}

}  // namespace

TEST_CASE("Between the marks the border of a noisy bright ball is found") {
    const ImageGeometry g = lattice();
    const Image image = picture(
        g, [](const Vec3& x) { return 100 - 60 * step_at(length(x) - kRadius); }, 20);
    for (const int count : {20, 60}) {
        const std::vector<Vec3> marks = marks_on_sphere(count, kRadius);
        const FloatGridPtr guess = wavy_sphere(domain_of_image(g), marks, 1.5);
        const auto [target, report] = guide(*guess, marks, image);
        const Radius before = radius_of(*guess, kRadius), after = radius_of(*target, kRadius);
        INFO(count << " marks: off by " << before.rms << " before, " << after.rms << " after; " << report.reason);
        CHECK(report.used);
        CHECK(std::abs(after.mean) < 0.1);
        CHECK(after.rms < 0.4 * before.rms);
    }
}

TEST_CASE("A guess that is off by up to three voxels between 20 marks is moved to the border") {
    const ImageGeometry g = lattice();
    const Image image = picture(
        g, [](const Vec3& x) { return 100 - 60 * step_at(length(x) - kRadius); }, 10);
    const std::vector<Vec3> marks = marks_on_sphere(20, kRadius);
    const FloatGridPtr guess = wavy_sphere(domain_of_image(g), marks, 3);
    const auto [target, report] = guide(*guess, marks, image);
    CHECK(radius_of(*guess, kRadius).rms > 0.8);
    CHECK(radius_of(*target, kRadius).rms < 0.35);
    CHECK(radius_of(*target, kRadius).largest < 1.2);
}

TEST_CASE("An image of noise does not worsen the guess, and a constant image does not change it") {
    const ImageGeometry g = lattice();
    const std::vector<Vec3> marks = marks_on_sphere(60, kRadius);
    const FloatGridPtr guess = wavy_sphere(domain_of_image(g), marks, 1.5);
    const double before = radius_of(*guess, kRadius).rms;
    for (unsigned seed = 1; seed <= 5; ++seed) {
        const Image image = picture(
            g, [](const Vec3&) { return 50; }, 20, seed);
        const auto [target, report] = guide(*guess, marks, image);
        INFO("seed " << seed << ", gain " << report.gain << ", image error " << report.image_error);
        CHECK(radius_of(*target, kRadius).rms < before + 0.05);
        if (!report.used) CHECK_FALSE(report.reason.empty());
    }
    const Image blank = picture(
        g, [](const Vec3&) { return 50; }, 0);
    const auto [target, report] = guide(*guess, marks, blank);
    CHECK_FALSE(report.used);
    CHECK(radius_of(*target, kRadius).rms == Approx(before).epsilon(0.01));
}

TEST_CASE("A stained membrane is found, whether bright or dark") {
    const ImageGeometry g = lattice();
    for (const double line : {80.0, -40.0}) {
        const Image image = picture(
            g, [&](const Vec3& x) { return 50 + line * std::exp(-0.5 * std::pow(length(x) - kRadius, 2)); }, 10);
        const std::vector<Vec3> marks = marks_on_sphere(40, kRadius);
        const FloatGridPtr guess = wavy_sphere(domain_of_image(g), marks, 2);
        const auto [target, report] = guide(*guess, marks, image);
        INFO("line " << line << " " << report.reason << " image error " << report.image_error);
        CHECK(radius_of(*target, kRadius).rms < 0.4 * radius_of(*guess, kRadius).rms);
    }
}

TEST_CASE("The border is found at the marks' intensity profile, not at the steepest slope") {
    // The slope of the image is steepest one and a half voxels inside of the sphere on which the marks lie.
    const ImageGeometry g = lattice();
    const Image image = picture(
        g, [](const Vec3& x) { return 100 - 60 * step_at((length(x) - kRadius + 1.5) / 2); }, 5);
    const std::vector<Vec3> marks = marks_on_sphere(60, kRadius);
    const FloatGridPtr guess = wavy_sphere(domain_of_image(g), marks, 1.5);
    const auto [target, report] = guide(*guess, marks, image);
    CHECK(std::abs(radius_of(*target, kRadius).mean) < 0.15);
    CHECK(radius_of(*target, kRadius).rms < 0.5 * radius_of(*guess, kRadius).rms);
}

TEST_CASE("A brighter structure nearby does not attract the surface") {
    const ImageGeometry g = lattice();
    // Beside the marked ball, two voxels away, there is a second, brighter one.
    const double other = 8;
    const Vec3 at{kRadius + 2 + other, 0, 0};
    const Image image = picture(
        g,
        [&](const Vec3& x) {
            return 40 + 60 * (1 - step_at(length(x) - kRadius)) +
                   110 * (1 - step_at(length({x[0] - at[0], x[1] - at[1], x[2] - at[2]}) - other));
        },
        10);
    const std::vector<Vec3> marks = marks_on_sphere(60, kRadius);
    const FloatGridPtr guess = wavy_sphere(domain_of_image(g), marks, 1.5);
    const auto [target, report] = guide(*guess, marks, image);
    CHECK(radius_of(*target, kRadius).rms < 0.5 * radius_of(*guess, kRadius).rms);
    CHECK(radius_of(*target, kRadius).largest < radius_of(*guess, kRadius).largest);
}

TEST_CASE("The border is found in slices that are five voxels apart") {
    const ImageGeometry g = lattice(5);
    const Image image = picture(
        g, [](const Vec3& x) { return 100 - 60 * step_at(length(x) - kRadius); }, 10);
    const std::vector<Vec3> marks = marks_on_sphere(40, kRadius, 0.25);
    const FloatGridPtr guess = wavy_sphere(domain_of_image(g), marks, 2);
    const auto [target, report] = guide(*guess, marks, image);
    CHECK(radius_of(*target, kRadius).rms < 0.8 * radius_of(*guess, kRadius).rms);
}

TEST_CASE("Guidance is bit-identical for 1, 2 and 8 threads") {
    const ImageGeometry g = lattice();
    const Image image = picture(
        g, [](const Vec3& x) { return 100 - 60 * step_at(length(x) - kRadius); }, 20);
    const std::vector<Vec3> marks = marks_on_sphere(60, kRadius);
    const FloatGridPtr guess = wavy_sphere(domain_of_image(g), marks, 1.5);
    std::vector<FloatGridPtr> results;
    for (const int threads : {1, 2, 8}) {
        RunContext run;
        run.threads = threads;
        results.push_back(guide(*guess, marks, image, {}, run).u);
    }
    for (std::size_t n = 1; n < results.size(); ++n) {
        REQUIRE(results[n]->activeVoxelCount() == results[0]->activeVoxelCount());
        const auto accessor = results[0]->getConstAccessor();
        for (auto v = results[n]->cbeginValueOn(); v; ++v) {
            const float a = *v, b = accessor.getValue(v.getCoord());
            REQUIRE(std::memcmp(&a, &b, sizeof a) == 0);
        }
    }
}

TEST_CASE("Giving the automatic precision of marks changes nothing, another precision changes the error") {
    const ImageGeometry g = lattice();
    const Image image = picture(
        g, [](const Vec3& x) { return 100 - 60 * step_at(length(x) - kRadius); }, 20);
    const std::vector<Vec3> marks = marks_on_sphere(60, kRadius);
    const FloatGridPtr guess = wavy_sphere(domain_of_image(g), marks, 1.5);
    GuidanceOptions options;
    const GuidanceReport automatic = guide(*guess, marks, image, options).report;
    REQUIRE(automatic.used);
    // The automatic precision of marks is the standard deviation of a uniform distribution over a voxel.
    options.mark_precision = kUniformDeviation * g.spacing[0];
    const GuidanceReport stated = guide(*guess, marks, image, options).report;
    CHECK(stated.gain == Approx(automatic.gain));
    CHECK(stated.image_error == Approx(automatic.image_error));
    options.mark_precision = 5 * g.spacing[0];
    const GuidanceReport coarse = guide(*guess, marks, image, options).report;
    CHECK(coarse.image_error != Approx(automatic.image_error));
}

TEST_CASE("Guidance names and rejects an option that is out of range") {
    GuidanceOptions options;
    options.weight = 2;
    CHECK(why_invalid(options).find("weight: expected 0 to 1, got 2") == 0);
    const ImageGeometry g = lattice();
    const Image image = picture(
        g, [](const Vec3& x) { return length(x); }, 0);
    const FloatGridPtr guess = start_from_sphere(domain_of_image(g), {0, 0, 0}, 10);
    CHECK_THROWS_AS(guide(*guess, marks_on_sphere(20, 10), image, options), Error);
}
