#include <catch2/catch.hpp>

#include <cmath>
#include <functional>

#include "support/both_solvers.h"
#include "support/dense_reference.h"
#include "support/shapes.h"

// Tests of the scheme of docs/method.md, as implemented by the dense reference: closed forms, and for each erratum of
// the printed paper an identity that the corrected form and evolve() satisfy and the printed form violates.

using namespace covol;
using namespace covol::test;

namespace {

constexpr double kH = 0.5;

double signed_sphere(const Vec3& x, double radius) { return length(x) - radius; }

/// The level set of a closed surface without any symmetry.
double lopsided(const Vec3& x) {
    return std::sqrt(x[0] * x[0] + 1.7 * x[1] * x[1] + 0.6 * x[2] * x[2] + 0.4 * x[0] * x[2]) - 1.9 +
           0.3 * std::sin(2 * x[1]);
}

/// The maximum of |mirror(S(mirror(u))) - S(u)| in voxels, where S is the solver's result after two steps. It is 0 for
/// a scheme that prefers no side.
double mirror_defect(const Problem& p, const Solver& solver, int axis) {
    const Symmetry flip = mirror(axis);
    Problem mirrored = p;
    mirrored.u = flip(p.u);
    if (p.distance.size() > 0) mirrored.distance = flip(p.distance);
    if (p.edge.size() > 0) mirrored.edge = flip(p.edge);
    return max_difference(flip(solver(mirrored, 2)), solver(p, 2)) / p.domain.voxel_size;
}

}  // namespace

TEST_CASE("The gradients of a linear function are exact on all 24 tetrahedra") {
    const Domain d = cube_domain(3, kH);
    const DenseField u = [&] {  // ghosts, too, have the values of the linear function, not mirrored ones
        DenseField f(3, 3, 3, kH);
        for (int i = -1; i <= 3; ++i)
            for (int j = -1; j <= 3; ++j)
                for (int k = -1; k <= 3; ++k) f.at(i, j, k) = 0.25 + kH * (1.5 * i - 2.25 * j + 0.75 * k);
        return f;
    }();
    for_each_voxel(d, [&](int i, int j, int k, const Vec3&) {
        for (const Gradient& g : tetrahedron_gradients(u, i, j, k)) {
            CHECK(g[0] == Approx(1.5));
            CHECK(g[1] == Approx(-2.25));
            CHECK(g[2] == Approx(0.75));
        }
    });
}

TEST_CASE("The gradients of the four tetrahedra on the +x face equal the formulas") {
    const Domain d = cube_domain(3, kH);
    const DenseField u = sample(d, random_waves(3, 1.0));
    const auto z = [&](int s, int t) {
        double sum = 0;
        for (int i = 1; i <= 2; ++i)
            for (int j = 0; j <= 1; ++j)
                for (int k = 0; k <= 1; ++k) sum += u.at(i, j + (s > 0), k + (t > 0)) / 8;
        return sum;
    };
    const double up = u.at(1, 1, 1), uq = u.at(2, 1, 1);
    const auto all = tetrahedron_gradients(u, 1, 1, 1);
    int found = 0;
    for (int side = -1; side <= 1; side += 2) {
        const Gradient expected_y_edge{(uq - up) / kH, side * (z(side, -1) + z(side, 1) - up - uq) / kH,
                                       (z(side, 1) - z(side, -1)) / kH};
        const Gradient expected_z_edge{(uq - up) / kH, (z(1, side) - z(-1, side)) / kH,
                                       side * (z(-1, side) + z(1, side) - up - uq) / kH};
        for (const Gradient& expected : {expected_y_edge, expected_z_edge})
            for (int l = 0; l < 4; ++l) {
                const Gradient& g = all[l];
                if (std::abs(g[0] - expected[0]) + std::abs(g[1] - expected[1]) + std::abs(g[2] - expected[2]) < 1e-12)
                    ++found;
            }
    }
    CHECK(found == 4);
}

TEST_CASE("Neighbouring voxels have equal squared gradients on their common face") {
    const DenseField u = sample(cube_domain(5, kH), random_waves(4, 1.0));
    for (int face = 0; face < 6; ++face) {
        const auto& q = kFaces[face];
        const auto here = tetrahedron_gradients(u, 2, 2, 2),
                   there = tetrahedron_gradients(u, 2 + q[0], 2 + q[1], 2 + q[2]);
        const auto sum = [](const std::array<Gradient, 24>& g, int f, int axis) {
            double s = 0;
            for (int l = 4 * f; l < 4 * f + 4; ++l) s += g[l][axis] * g[l][axis];
            return s;
        };
        for (int axis = 0; axis < 3; ++axis)
            CHECK(sum(here, face, axis) == Approx(sum(there, face ^ 1, axis)).epsilon(1e-12));
    }
}

TEST_CASE("Off-diagonal coefficients are not positive, and constants solve the system") {
    Problem p = whole_cube(8, kH, random_waves(5, 1.5));
    set_distance(p, [](const Vec3& x) { return length(x); });
    set_edge(p, [](const Vec3& x) { return 0.6 + 0.4 * std::sin(3 * x[0] + x[1]); });
    p.options.delta = kH;
    p.options.tau = 100 * kH;
    const DenseSystem system = assemble(p.u, p.active, {&p.distance, &p.edge}, p.options);
    REQUIRE(system.voxel.size() == 512);
    REQUIRE(system.a.size() == 6 * 512);
    for (const double a : system.a) CHECK(a <= 0);
    // The row sum is 1 exactly when a constant solves the system with itself as the right-hand side.
    DenseField constant(8, 8, 8, kH, 2.0);
    DenseSystem ones = system;
    ones.right_side.assign(512, 2.0);
    CHECK(solve(ones, constant, p.options) == 1);
    CHECK(max_difference(constant, DenseField(8, 8, 8, kH, 2.0)) == 0);
}

TEST_CASE("The taper falls from 1 at half the range to 0 at the range, and the potential is its integral") {
    const double r = 3.0;
    CHECK(attraction_taper(1.4, r) == 1);
    CHECK(attraction_taper(1.5, r) == 1);
    CHECK(attraction_taper(2.25, r) == Approx(0.5));
    CHECK(attraction_taper(3.0, r) == 0);
    CHECK(attraction_taper(7.0, r) == 0);
    CHECK(attraction_taper(7.0, 0) == 1);
    CHECK(attraction_potential(7.0, 0) == 7.0);
    for (double x = 0.05; x < 4; x += 0.1) {
        const double slope = (attraction_potential(x + 1e-5, r) - attraction_potential(x - 1e-5, r)) / 2e-5;
        CHECK(slope == Approx(attraction_taper(x, r)).margin(1e-6));
    }
}

TEST_CASE("v_pq: unknown distances to the points do not attract, and an inactive voxel keeps its value") {
    Problem p = whole_cube(8, kH, [](const Vec3& x) { return x[0]; });
    set_distance(p, [](const Vec3& x) { return x[0] > 0 ? NAN : 5 - x[0]; });
    p.active[p.u.index(1, 1, 1)] = 0;
    const DenseSystem system = assemble(p.u, p.active, {&p.distance, nullptr}, p.options);
    REQUIRE(system.voxel.size() == 511);
    for (std::size_t row = 0; row < system.voxel.size(); ++row) {
        double sum = 0;
        for (int q = 0; q < 6; ++q) sum += system.a[6 * row + q];
        const int i = static_cast<int>(system.voxel[row] / 100) - 1;  // 10 x 10 padded voxels in a slice
        // The flow is along +x at unit speed, so that -x is upwind. At i = 0 the upwind neighbour is the voxel's own
        // mirror image, and at i = 4 the distance is unknown.
        CHECK(sum == Approx(i >= 1 && i <= 3 ? -p.options.tau / kH : 0.0).margin(1e-6));
    }
    const DenseField after = run_dense(p, 1);
    CHECK(after.at(1, 1, 1) == p.u.at(1, 1, 1));
    CHECK(after.at(2, 2, 2) != p.u.at(2, 2, 2));
}

TEST_CASE("The image term has unit speed on a slope of g, and fades if the slope is below epsilon") {
    for (const double slope : {0.2, 1e-3, 1e-6}) {  // slope of g per voxel
        Problem p = whole_cube(8, kH, [](const Vec3& x) { return x[1]; });
        p.edge = sample(p.domain, [&](const Vec3& x) { return 0.5 + slope * x[1] / kH; });
        p.options.rho = 1;
        const DenseSystem system = assemble(p.u, p.active, {nullptr, &p.edge}, p.options);
        const std::size_t row = (3 * 8 + 3) * 8 + 3;
        const double speed = slope / std::sqrt(1e-6 + slope * slope);
        // -∇g points to -y, so that +y is upwind.
        for (int q = 0; q < 6; ++q)
            CHECK(system.a[6 * row + q] == Approx(q == 2 ? -p.options.tau / kH * speed : 0.0).margin(1e-12));
    }
}

TEST_CASE("Near marks the image term is reduced in proportion to the taper") {
    Problem p = whole_cube(8, kH, [](const Vec3& x) { return x[1]; });
    p.distance = sample(p.domain, [](const Vec3& x) { return x[0] + 2; });
    p.edge = sample(p.domain, [](const Vec3& x) { return 0.5 + 0.1 * x[1]; });
    p.options.rho = 1;
    p.options.attraction_range = 3.0;
    p.options.image_yields = 0.75;
    const DenseSystem system = assemble(p.u, p.active, {&p.distance, &p.edge}, p.options);
    for (int i = 0; i < 8; ++i) {
        const double taper = attraction_taper(p.distance.at(i, 3, 3), 3.0);
        const double pull = -system.a[6 * ((i * 8 + 3) * 8 + 3) + 2] * kH / p.options.tau;
        CHECK(pull == Approx(1 - 0.75 * taper).epsilon(1e-3));
    }
}

TEST_CASE("The implicit heat equation damps a cosine by the exact factor of backward Euler") {
    const int n = 16;
    const Domain d = cube_domain(n, kH);
    // Neumann: half a wave over the box, sampled at centres, is an eigenvector of the discrete operator.
    DenseField image = sample(d, [&](const Vec3& x) { return std::cos(M_PI * (x[1] / (n * kH) + 0.5)); });
    const DenseField before = image;
    const double time = 0.8, eigenvalue = 4 / (kH * kH) * std::pow(std::sin(M_PI / (2 * n)), 2);
    dense_heat(image, time, 4);
    const double expected = std::pow(1 + time / 4 * eigenvalue, -4);
    for_each_voxel(d, [&](int i, int j, int k, const Vec3&) {
        CHECK(image.at(i, j, k) == Approx(expected * before.at(i, j, k)).margin(1e-9));
    });
}

TEST_CASE("The edge detector g of a linear image is 1/(1 + K s^2)") {
    const DenseField g = dense_edge(
        sample(cube_domain(6, kH), [](const Vec3& x) { return 0.1 * x[0] - 0.2 * x[1] + 0.2 * x[2]; }), 40.0);
    CHECK(g.at(2, 3, 2) == Approx(1 / (1 + 40.0 * 0.09)));
}

TEST_CASE("One step of the reference shrinks a sphere at the speed 2 delta / r") {
    Problem p = whole_cube(24, 0.125, [](const Vec3& x) { return signed_sphere(x, 1.0); });
    p.options.delta = 1;
    p.options.tau = 0.01;
    const DenseField u = run_dense(p, 1);
    double mean = 0;
    const auto crossings = zero_crossings(p.domain, u);
    for (const Crossing& c : crossings) mean += length(c.position) / crossings.size();
    CHECK(mean == Approx(std::sqrt(1 - 4 * 0.01)).margin(0.002));
}

// --- Errata of the printed paper. Each identity holds for the corrected form and evolve(), and fails for the printed
// form.

TEST_CASE("Erratum 1: with v^b as printed, a mirrored cloud does not give the mirrored surface") {
    Problem p = whole_cube(12, kH, lopsided);
    set_distance(p, [](const Vec3& x) { return distance(x, {0.4, -0.3, 1.1}); });
    for (int axis = 0; axis < 3; ++axis) {
        CHECK(mirror_defect(p, run_dense, axis) < 1e-6);
        CHECK(mirror_defect(p, by_evolve, axis) < 1e-4);
    }
    p.options.printed.bottom_velocity = true;
    CHECK(mirror_defect(p, run_dense, 2) > 0.1);
}

TEST_CASE("Erratum 2: with the root as printed, the motion depends on the scale of u") {
    Problem p = whole_cube(12, kH, lopsided);
    p.options.delta = kH;
    p.options.epsilon = 1e-6;
    const auto scale_defect = [](const Problem& at_1, const Solver& solver) {
        Problem at_16 = at_1;
        for (std::size_t q = 0; q < at_16.u.size(); ++q) at_16.u[q] *= 16;
        DenseField u = solver(at_16, 2);
        for (std::size_t q = 0; q < u.size(); ++q) u[q] /= 16;
        return max_difference(u, solver(at_1, 2)) / kH;
    };
    CHECK(scale_defect(p, run_dense) < 1e-6);
    CHECK(scale_defect(p, by_evolve) < 1e-4);
    p.options.printed.root = true;
    CHECK(scale_defect(p, run_dense) > 0.05);
}

TEST_CASE("Erratum 3: with the last sum as printed, the curvature term is not mirror symmetric") {
    Problem p = whole_cube(12, kH, lopsided);
    p.options.delta = kH;
    p.options.tau = 3 * kH;
    for (int axis = 0; axis < 3; ++axis) {
        CHECK(mirror_defect(p, run_dense, axis) < 1e-6);
        CHECK(mirror_defect(p, by_evolve, axis) < 1e-4);
    }
    p.options.printed.last_sum = true;
    CHECK(mirror_defect(p, run_dense, 2) > 0.01);
}

TEST_CASE("Erratum 4: with a sum over more than the six neighbours, a plane moves at more than twice its speed") {
    // u = x moves along parallel rays towards points at x = +5: after two steps the plane has moved by 2 tau.
    Problem p = whole_cube(16, kH, [](const Vec3& x) { return x[0]; });
    set_distance(p, [](const Vec3& x) { return 5 - x[0]; });
    p.options.tau = 0.2 * kH;
    const auto travelled = [](const Problem& problem, const Solver& solver) {
        const DenseField u = solver(problem, 2);
        double mean = 0;
        int n = 0;
        for (const Crossing& c : zero_crossings(problem.domain, u))
            if (c.voxel[1] == 8 && c.voxel[2] == 8) {
                mean += c.position[0];
                ++n;
            }
        return n > 0 ? mean / n : NAN;
    };
    // The values on the inflow side are fixed. After two steps, this changes the plane's position by only about 2e-3 h.
    CHECK(travelled(p, run_dense) == Approx(2 * p.options.tau).margin(0.02 * kH));
    CHECK(travelled(p, by_evolve) == Approx(travelled(p, run_dense)).margin(1e-4 * kH));
    p.options.printed.neighbours = true;
    CHECK(travelled(p, run_dense) > 4 * p.options.tau);
}

TEST_CASE("Erratum 5: with epsilon counted twice, a nearly constant u does not follow the heat equation") {
    // As |∇u| is far below ε, M W = ε / ε = 1, and one step is a step of backward Euler for u_t = δ Δu.
    constexpr double amplitude = 0.01;
    Problem p = whole_cube(12, kH, [](const Vec3& x) { return amplitude * std::cos(M_PI * (x[2] / (12 * kH) + 0.5)); });
    p.options.delta = 0.5;
    p.options.epsilon = 1;
    p.options.tau = 4;
    DenseField expected = p.u;
    dense_heat(expected, p.options.delta * p.options.tau, 1);
    const auto defect = [&](const Solver& solver) { return max_difference(solver(p, 1), expected) / amplitude; };
    CHECK(defect(run_dense) < 1e-3);
    CHECK(defect(by_evolve) < 1e-3);
    p.options.printed.gradient_norm = true;
    CHECK(defect(run_dense) > 0.05);
}
