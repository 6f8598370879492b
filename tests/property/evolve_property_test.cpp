#include <catch2/catch.hpp>

#include <cmath>
#include <cstdio>
#include <random>

#include "support/both_solvers.h"
#include "support/shapes.h"

// Properties of evolve() that hold for any fields, on seeded random ones.

using namespace covol;
using namespace covol::test;

namespace {

constexpr double kH = 0.25;

/// A random start with random points and a random image; leaves begin at voxels that depend on the seed.
Problem random_problem(std::uint32_t seed, int n) {
    std::mt19937 generator(seed);
    const auto uniform = [&](double low, double high) { return low + (high - low) * (generator() / 4294967296.0); };
    const Function waves = random_waves(seed + 1000, 1.5), image = random_waves(seed + 2000, 1.2);
    Problem p = whole_cube(
        n, kH, [&](const Vec3& x) { return clamp_to(1.5 * waves(x), 3 * kH); }, static_cast<int>(uniform(-20, 20)));
    std::vector<Vec3> points(6);
    for (Vec3& point : points)
        for (double& x : point) x = uniform(-0.5, 0.5) * n * kH;
    set_distance(
        p, [&](const Vec3& x) { return distance_to(points, x); }, uniform(0.3, 1));
    set_edge(
        p, [&](const Vec3& x) { return 0.55 + 0.22 * image(x); }, uniform(0.3, 1));
    p.options.delta = kH * uniform(0.2, 3);
    p.options.tau = kH;
    return p;
}

}  // namespace

TEST_CASE("min u0 <= u <= max u0 for every time step") {
    for (std::uint32_t seed = 1; seed <= 8; ++seed)
        for (const double tau : {1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0}) {
            Problem p = random_problem(seed, 14);
            p.options.tau = tau * kH;
            double low = INFINITY, high = -INFINITY;
            for_each_voxel(p.domain, [&](int i, int j, int k, const Vec3&) {
                low = std::min(low, p.u.at(i, j, k));
                high = std::max(high, p.u.at(i, j, k));
            });
            EvolveOptions options = evolve_options(p.options, 3);
            options.solver_tolerance = EvolveOptions{}.solver_tolerance;
            options.max_sweeps = EvolveOptions{}.max_sweeps;
            INFO("seed " << seed << ", tau = " << tau << " h");
            const FloatGridPtr u = run_evolve_grid(p, options);
            double outside = 0;
            for (auto v = u->cbeginValueOn(); v; ++v) outside = std::max({outside, low - *v, *v - high});
            CHECK(outside <= 1e-6 * kH);
        }
}

// Sums in another order may round a coefficient, which has 16 bits, to the next unit, which changes u by up to this.
constexpr double kRounding = 4e-4;  // h

TEST_CASE("evolve() equals the dense reference on random fields") {
    double worst = 0;
    for (std::uint32_t seed = 1; seed <= 8; ++seed) {
        Problem p = random_problem(seed, 15);
        if (seed % 2 == 0) {
            p.options.attraction_range = 5 * kH;
            p.options.image_yields = 0.6;
        }
        if (seed % 3 == 0) {  // frozen voxels inside the band
            const Function holes = random_waves(seed + 3000, 1.0);
            p.active = active_where(p.domain, p.u, [&](const Vec3& x) { return holes(x) < 0.3; });
        }
        const double difference = max_difference(run_evolve(p, 3), run_dense(p, 3)) / kH;
        worst = std::max(worst, difference);
        INFO("seed " << seed << ": differs by " << difference << " h");
        CHECK(difference < 1e-3);
    }
    std::printf("evolve() and the dense reference on random fields: largest difference %.1e h\n", worst);
}

TEST_CASE("Mirrored and axis-permuted fields give mirrored and permuted results") {
    const std::uint32_t seed = 7;
    const Problem p = random_problem(seed, 13);
    const DenseField expected = run_evolve(p, 3);
    REQUIRE(all_symmetries().size() == 48);
    for (const Symmetry& symmetry : all_symmetries()) {
        Problem moved = p;
        moved.u = symmetry(p.u);
        moved.distance = symmetry(p.distance);
        moved.edge = symmetry(p.edge);
        const double difference = max_difference(run_evolve(moved, 3), symmetry(expected)) / kH;
        INFO("seed " << seed << ", axes " << symmetry.axis[0] << symmetry.axis[1] << symmetry.axis[2] << ", flips "
                     << symmetry.flip[0] << symmetry.flip[1] << symmetry.flip[2]);
        CHECK(difference < kRounding);
    }
}

TEST_CASE("A shift by whole voxels shifts the result, wherever the leaves begin") {
    const std::uint32_t seed = 9;
    Problem p = random_problem(seed, 13);
    const DenseField expected = run_evolve(p, 3);
    for (const int shift : {1, 3, 8, -11}) {
        Problem moved = p;
        for (int a = 0; a < 3; ++a) {
            moved.domain.min[a] += shift * (a + 1);
            moved.domain.max[a] += shift * (a + 1);
        }
        INFO("seed " << seed << ", shift " << shift);
        CHECK(max_difference(run_evolve(moved, 3), expected) / kH < kRounding);
    }
}

TEST_CASE("evolve() in a band has the zero level set of the dense double-precision solver") {
    // All options: points in part of a sphere, an edge elsewhere, a clamped start, frozen values outside the band.
    constexpr int n = 36;
    const Domain domain = cube_domain(n, kH, -7);
    const double radius = 3.0, start = 3.25;
    for (std::uint32_t seed = 1; seed <= 2; ++seed) {
        const Function bumps = random_waves(seed, 2.0);
        const Function surface = [&](const Vec3& x) { return length(x) - start - 0.15 * bumps(x); };
        std::vector<Vec3> points;
        for (const Vec3& x : sphere_points(400, radius))
            if (x[2] > -0.5) points.push_back({1.02 * x[0], 0.96 * x[1], 1.04 * x[2]});
        Problem p;
        p.domain = domain;
        p.u = rounded(sample(domain, [&](const Vec3& x) { return clamp_to(surface(x), 3 * kH); }));
        p.active = active_where(domain, p.u, [&](const Vec3& x) { return std::abs(surface(x)) < 4.5 * kH; });
        set_distance(p, [&](const Vec3& x) { return distance_to(points, x); });
        set_edge(p, [&](const Vec3& x) { return 1 - 0.9 * std::exp(-std::pow((length(x) - 3.1) / (1.5 * kH), 2)); });
        p.options.delta = kH;
        p.options.tau = kH;
        p.options.attraction_range = 5 * kH;
        p.options.image_yields = seed == 2 ? 0.5 : 0.0;
        const int steps = 15;
        const DenseField dense = run_dense(p, steps);

        double moved = 0;
        const auto crossings = zero_crossings(domain, dense);
        for (const Crossing& c : crossings)
            moved += std::abs(surface(c.position)) / kH / static_cast<double>(crossings.size());
        EvolveOptions options = evolve_options(p.options, steps);
        const auto difference = [&] {
            return zero_level_difference(domain, dense, to_dense(domain, *run_evolve_grid(p, options)));
        };
        const LevelSetDifference exact = difference();
        options.solver_tolerance = EvolveOptions{}.solver_tolerance;
        const LevelSetDifference usual = difference();
        std::printf(
            "band against dense, seed %u: %zu crossings, moved by %.2f h in the mean; apart by %.1e h (mean %.1e), "
            "with the default solver tolerance %.1e h (mean %.1e)\n",
            seed, exact.count, moved, exact.max, exact.mean, usual.max, usual.mean);
        INFO("seed " << seed);
        CHECK(exact.count > 1000);
        CHECK(moved > 0.8);  // in voxels; if the surface had hardly moved, there would be nothing to compare
        CHECK(exact.max < 1e-3);
        CHECK(usual.mean < 1e-3);
        CHECK(usual.max < 1e-2);
    }
}
