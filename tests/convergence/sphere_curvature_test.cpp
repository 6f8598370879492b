#include <catch2/catch.hpp>

#include <cmath>
#include <cstdio>
#include <string>

#include "support/both_solvers.h"
#include "support/shapes.h"

// A sphere that moves by curvature alone, with the weight δ: after the time t its radius r is r² = r0² - 4 δ t.

using namespace covol;
using namespace covol::test;

namespace {

constexpr double kStart = 1.0, kEnd = 0.7;  // radii of the sphere at the start and at the end
constexpr double kTime = (kStart * kStart - kEnd * kEnd) / 4;

/// The mean of | |x| - radius | over the positions x at which the zero level set cuts edges of the lattice.
double radius_error(const Domain& domain, const DenseField& u, double radius) {
    const auto crossings = zero_crossings(domain, u);
    REQUIRE(crossings.size() > 50);
    double sum = 0;
    for (const Crossing& c : crossings) sum += std::abs(length(c.position) - radius);
    return sum / static_cast<double>(crossings.size());
}

/// @return the observed order of convergence when h was halved; NAN at the first h, for which `previous` is 0
double print_order(const char* what, double h, double error, double previous) {
    std::printf("%s: h = %.4f, error %.2e = %.3f h", what, h, error, error / h);
    if (previous == 0) {
        std::printf("\n");
        return NAN;
    }
    const double order = std::log2(previous / error);
    std::printf(", observed order %.2f\n", order);
    return order;
}

EvolveOptions curvature_alone(double tau) {
    EvolveOptions o;
    o.theta = o.rho = 0;
    o.delta = 1;
    o.tolerance = 0;
    o.max_steps = static_cast<int>(std::lround(kTime / tau));
    o.tau = kTime / o.max_steps;
    return o;
}

double signed_distance(const Vec3& x) { return length(x) - kStart; }

}  // namespace

TEST_CASE("the dense reference: a shrinking sphere, first order in h or better") {
    double previous = 0;
    for (const int n : {10, 20, 40}) {
        const double h = 2.8 / n;
        Problem p = whole_cube(n, h, signed_distance);
        const EvolveOptions o = curvature_alone(0.1 * h);
        p.options.delta = *o.delta;
        p.options.tau = *o.tau;
        p.options.solver_tolerance = 1e-4;
        const double error = radius_error(p.domain, run_dense(p, o.max_steps), kEnd);
        const double order = print_order("dense, whole domain, tau = h/10", h, error, previous);
        if (previous > 0) CHECK(order > 0.9);
        previous = error;
    }
}

TEST_CASE("evolve(): a shrinking sphere, first order in h or better") {
    double previous = 0;
    for (const int n : {20, 40, 80}) {
        const double h = 2.8 / n;
        const Domain domain = cube_domain(n, h);
        const FloatGridPtr u = to_grid(domain, sample(domain, signed_distance), "u");
        evolve(*u, {}, curvature_alone(0.1 * h));
        const double error = radius_error(domain, to_dense(domain, *u), kEnd);
        const double order = print_order("evolve, whole domain, tau = h/10", h, error, previous);
        CHECK(error < 0.1 * h);
        if (previous > 0) CHECK(order > 0.9);
        previous = error;
    }
}

double tracked_error(int n, double fraction) {
    const double h = 2.8 / n;
    const Domain domain = cube_domain(n, h);
    const FloatGridPtr u = start_grid(domain, signed_distance, 3 * h);
    EvolveOptions o = curvature_alone(fraction * h * h);
    o.follow = true;
    evolve(*u, {}, o);
    return radius_error(domain, to_dense(domain, *u), kEnd);
}

// The values at the band's border are frozen. They slow the surface down if sqrt(δτ) is close to the band's width,
// which is a number of voxels. Therefore the time step τ is proportional to h².
TEST_CASE("evolve() with a tracked band: a shrinking sphere, first order in h or better") {
    const double fraction = GENERATE(1.0, 0.25);
    double previous = 0;
    for (const int n : {20, 40, 80}) {
        const double h = 2.8 / n, error = tracked_error(n, fraction);
        const std::string what = "evolve, tracked band, tau = " + std::to_string(fraction) + " h^2";
        const double order = print_order(what.c_str(), h, error, previous);
        CHECK(error < 0.075 * h);
        if (previous > 0) CHECK(order >= 1);
        previous = error;
    }
}
