#include <catch2/catch.hpp>

#include <cmath>
#include <cstdio>

#include "support/both_solvers.h"
#include "support/shapes.h"

// Pure advection, without curvature (δ = 0) and edges (ρ = 0): the surface runs at unit speed along -∇d, d the distance
// to points, and stops where d = 0.

using namespace covol;
using namespace covol::test;

namespace {

/// A plane across `axis` that moves in the direction `sign` from its start at `from` to `to`, where d = 0.
struct PlaneRun {
    double h, from, to;
    int axis, sign;
    double ramp;  ///< half width of the start's ramp, voxels

    [[nodiscard]] double along(const Vec3& x) const { return sign * x[axis]; }

    /// Mean position of the plane along its path after `time`, in `steps` steps.
    [[nodiscard]] double position(double time, int steps) const {
        Domain domain = cube_domain(static_cast<int>(std::lround(3.0 / h)), h);
        for (int a = 0; a < 3; ++a)
            if (a != axis) domain.max[a] = domain.min[a] + 5;
        const FloatGridPtr u = make_grid(domain, 0.0F, "u"), d = make_grid(domain, 0.0F, "distance");
        for_each_voxel(domain, [&](int i, int j, int k, const Vec3& x) {
            u->tree().setValueOn(coord(domain, i, j, k), static_cast<float>(clamp_to(along(x) - from, ramp * h)));
            d->tree().setValueOn(coord(domain, i, j, k), static_cast<float>(std::abs(along(x) - to)));
        });
        EvolveOptions o;
        o.theta = 1;
        o.rho = 0;
        o.delta = 0;
        o.tolerance = 0;
        o.solver_tolerance = 1e-6;
        o.max_steps = steps;
        o.tau = time / steps;
        EvolveFields fields;
        fields.distance = d.get();
        evolve(*u, fields, o);
        const auto crossings = zero_crossings(domain, to_dense(domain, *u));
        REQUIRE(!crossings.empty());
        double mean = 0;
        for (const Crossing& c : crossings) {
            REQUIRE(c.axis == axis);
            mean += along(c.position) / static_cast<double>(crossings.size());
        }
        return mean;
    }
};

}  // namespace

TEST_CASE("a plane runs at unit speed in each of the six directions") {
    // One implicit upwind step of the time τ, with voxels of edge h, spreads a jump over a geometric distribution with
    // mean c = τ/h, variance c(1+c) and third cumulant c(1+c)(1+2c), in voxels. After many steps the median of the
    // profile therefore lags behind the mean by (1+2c)/6 voxels, and by less as long as the start's ramp of six voxels
    // is not smeared out.
    constexpr double way = 0.5;
    for (const double courant : {0.25, 1.0})
        for (int axis = 0; axis < 3; ++axis)
            for (const int sign : {-1, 1}) {
                const PlaneRun run{0.05, -0.8, 1.2, axis, sign, 3};
                const double position = run.position(way, static_cast<int>(std::lround(way / (courant * run.h))));
                const double lag = (run.from + way - position) / run.h;
                INFO("axis " << axis << ", sign " << sign << ", tau = " << courant << " h, behind by " << lag << " h");
                CHECK(lag > -0.05);
                CHECK(lag < (1 + 2 * courant) / 6 + 0.05);
            }
}

// With a ramp of half a voxel the start is a jump. The plane then lags behind its exact position by (1+2c)/6 voxels,
// c = τ/h, from the beginning on, for every h. This error is of first order.
TEST_CASE("a plane arrives on time, first order in h, and stays") {
    // The time step is fraction * h^power.
    const auto [power, fraction] = GENERATE(table<double, double>({{1, 1}, {2, 1}, {2, 0.25}}));
    for (const double h : {0.1, 0.05, 0.025}) {
        const PlaneRun run{h, -0.613, 0.4, 0, 1, 0.5};
        const double way = run.to - run.from, tau = fraction * std::pow(h, power);
        const double half = run.position(0.5 * way, static_cast<int>(std::lround(0.5 * way / tau)));
        const double late = run.position(1.5 * way, static_cast<int>(std::lround(1.5 * way / tau)));
        const double error = std::abs(half - 0.5 * (run.from + run.to)), off = std::abs(late - run.to);
        std::printf("plane, h = %.3f, tau = %.2f h^%.0f: half way off by %.2e = %.3f h, at rest off by %.3f h\n", h,
                    fraction, power, error, error / h, off / h);
        CHECK(error / h == Approx((1 + 2 * tau / h) / 6).margin(0.02));
        CHECK(off < 0.1 * h);
    }
}

TEST_CASE("a plane that starts as a distance arrives on time and stays") {
    double previous = 0;
    for (const double h : {0.1, 0.05, 0.025}) {
        const PlaneRun run{h, -0.613, 0.4, 0, 1, 3};
        const double way = run.to - run.from;
        const double half = run.position(0.5 * way, static_cast<int>(std::lround(0.5 * way / h)));
        const double late = run.position(1.5 * way, static_cast<int>(std::lround(1.5 * way / h)));
        const double error = std::abs(half - 0.5 * (run.from + run.to));
        CHECK(error < 0.5 * h);
        CHECK(std::abs(late - run.to) < 0.2 * h);
        if (previous > 0) CHECK(std::log2(previous / error) > 0.6);
        previous = error;
    }
}

// The error of the scheme itself: because of its one-sided differences, the surface moves at the position x, at the
// distance r from the centre, with a speed of 1 + h Σ |n_a| (1 - n_a²) / r, n = x / r, instead of 1.
TEST_CASE("a sphere shrinks at unit speed towards a point, first order in h") {
    // The time step is fraction * h^power; `maximum` is the largest allowed error in voxels.
    const auto [power, fraction, maximum] =
        GENERATE(table<double, double, double>({{1, 1, 0.5}, {2, 1, 0.6}, {2, 0.25, 0.6}}));
    double previous = 0;
    for (const int n : {24, 48, 96}) {
        const double h = 3.0 / n, time = 0.5;
        const Domain domain = cube_domain(n, h);
        const FloatGridPtr u = start_grid(
            domain, [](const Vec3& x) { return length(x) - 1.2; }, 3 * h);
        const FloatGridPtr d = to_grid(domain, sample(domain, [](const Vec3& x) { return length(x); }), "distance");
        EvolveOptions o;
        o.theta = 1;
        o.rho = 0;
        o.delta = 0;
        o.tolerance = 0;
        o.follow = true;
        o.max_steps = static_cast<int>(std::lround(time / (fraction * std::pow(h, power))));
        o.tau = time / o.max_steps;
        EvolveFields fields;
        fields.distance = d.get();
        evolve(*u, fields, o);
        const auto crossings = zero_crossings(domain, to_dense(domain, *u));
        REQUIRE(crossings.size() > 100);
        double error = 0;
        for (const Crossing& c : crossings)
            error += std::abs(length(c.position) - 0.7) / static_cast<double>(crossings.size());
        std::printf("sphere, h = %.4f, tau = %.2f h^%.0f: error %.2e = %.3f h", h, fraction, power, error, error / h);
        CHECK(error < maximum * h);
        if (previous > 0) {
            std::printf(", observed order %.2f", std::log2(previous / error));
            CHECK(std::log2(previous / error) >= 1);
        }
        std::printf("\n");
        previous = error;
    }
}
