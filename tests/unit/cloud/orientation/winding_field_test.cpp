#include "cloud/orientation/winding_field.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "support/clouds.h"
#include "support/surface_samples.h"

using namespace covol;
using namespace covol::cloud;

namespace {

/// Points of a sphere, area times normal of each.
struct Charged {
    std::vector<Vec3> points, vectors;
};

/// Evenly along a spiral.
Charged sphere(int count, double radius, const Vec3& center = {0, 0, 0}) {
    Charged s;
    for (int m = 0; m < count; ++m) {
        const double z = 1 - (2 * m + 1.0) / count, r = std::sqrt(1 - z * z), angle = m * M_PI * (3 - std::sqrt(5.0));
        const Vec3 n{r * std::cos(angle), r * std::sin(angle), z};
        s.points.push_back(test::sum(center, test::scaled(radius, n)));
        s.vectors.push_back(test::scaled(4 * M_PI * radius * radius / count, n));
    }
    return s;
}

double largest_difference(const LatticeField& a, const LatticeField& b) {
    double largest = 0;
    for (std::size_t n = 0; n < a.values.size(); ++n)
        largest = std::max(largest, double(std::abs(a.values[n] - b.values[n])));
    return largest;
}

Vec3 node(const Lattice& l, int i, int j, int k) {
    return {l.origin[0] + i * l.cell, l.origin[1] + j * l.cell, l.origin[2] + k * l.cell};
}

template <typename Visit>
void for_nodes(const Lattice& l, Visit visit) {
    std::size_t n = 0;
    for (int i = 0; i < l.nodes[0]; ++i)
        for (int j = 0; j < l.nodes[1]; ++j)
            for (int k = 0; k < l.nodes[2]; ++k) visit(n++, node(l, i, j, k));
}

}  // namespace

TEST_CASE("a lattice covers its box and the margin") {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0.01, 1);
    for (int trial = 0; trial < 200; ++trial) {
        WorldBox box;
        double longest = 0;
        for (int a = 0; a < 3; ++a) {
            box.min[a] = 10 * uniform(random) - 5;
            const double side = trial % 7 == a ? 0 : std::pow(uniform(random), 2);
            box.max[a] = box.min[a] + side;
            longest = std::max(longest, side);
        }
        const double share = 0.3 * uniform(random);
        const int cells = 16 + int(random() % 150);
        INFO("trial " << trial << ", share " << share << ", cells " << cells);
        const Lattice l = lattice_around(box, share, cells);
        int most = 0;
        for (int a = 0; a < 3; ++a) {
            REQUIRE((l.nodes[a] - 1) % 16 == 0);
            REQUIRE(l.nodes[a] >= 17);
            REQUIRE(l.origin[a] <= box.min[a] - share * longest + 1e-9);
            REQUIRE(l.origin[a] + (l.nodes[a] - 1) * l.cell >= box.max[a] + share * longest - 1e-9);
            most = std::max(most, l.nodes[a] - 1);
        }
        REQUIRE(l.cell == Approx(longest * (1 + 2 * share) / cells));
        REQUIRE(most < cells + 16);
    }
}

TEST_CASE("splines are exact on linear functions, and their gradient is that of their values") {
    const Lattice l = lattice_around({{-1, -1, -0.5}, {1, 1, 0.5}}, 0.1, 24);
    LatticeField linear(l), waves(l);
    for_nodes(l, [&](std::size_t n, const Vec3& x) {
        linear.values[n] = float(0.3 + 2 * x[0] - x[1] + 0.5 * x[2]);
        waves.values[n] = float(std::sin(3 * x[0]) * std::cos(2 * x[1]) + x[2] * x[0]);
    });
    for (const Vec3& x : test::box_cloud(300, {{-1, -1, -0.5}, {1, 1, 0.5}}, 2)) {
        const LatticeField::Sample s = linear.at(x);
        REQUIRE(s.value == Approx(0.3 + 2 * x[0] - x[1] + 0.5 * x[2]).margin(1e-6));
        const Vec3 slope{2, -1, 0.5};
        const double step = 2e-3;  // values are floats
        for (int a = 0; a < 3; ++a) {
            REQUIRE(s.gradient[a] == Approx(slope[a]).margin(1e-5));
            Vec3 low = x, high = x;
            low[a] -= step;
            high[a] += step;
            REQUIRE(waves.at(x).gradient[a] ==
                    Approx((waves.at(high).value - waves.at(low).value) / (2 * step)).margin(1e-4));
        }
    }
    // Beyond the lattice as at its end.
    CHECK(std::isfinite(linear.at({100, -100, 3}).value));
    CHECK(linear.at({100, 0, 0}).value == linear.at({1000, 0, 0}).value);
}

TEST_CASE("the density of points keeps their number and their centre, smoothed or not") {
    const std::vector<Vec3> points = test::box_cloud(500, {{-1, -0.4, 0}, {1, 0.8, 0.3}}, 3);
    const Lattice l = lattice_around(bounding_box(points), 0.5, 48);
    Vec3 center{0, 0, 0};
    for (const Vec3& p : points) center = test::sum(center, test::scaled(1.0 / 500, p));
    double spread = 0;
    for (const int passes : {0, 1, 6}) {
        const LatticeField density = point_density(l, points, passes);
        double count = 0, squares = 0;
        Vec3 mean{0, 0, 0};
        for_nodes(l, [&](std::size_t n, const Vec3& x) {
            REQUIRE(density.values[n] >= 0);
            count += double(density.values[n]);
            squares += double(density.values[n]) * test::dot(x, x);
            mean = test::sum(mean, test::scaled(double(density.values[n]) / 500, x));
        });
        INFO(passes << " passes");
        CHECK(count == Approx(500).epsilon(1e-4));
        for (int a = 0; a < 3; ++a) CHECK(mean[a] == Approx(center[a]).margin(1e-4));
        // Each pass adds half a cell squared to the variance along each axis.
        if (passes > 0)
            CHECK(squares / 500 == Approx(spread + 1.5 * passes * l.cell * l.cell).epsilon(1e-3));
        else
            spread = squares / 500;
    }
}

TEST_CASE("the indicator of a sphere is 1 inside, 0 outside, 1/2 on it, and rises inward") {
    for (const int cells : {32, 64}) {
        const Vec3 center{3.03, -2.01, 0.02};
        const Charged s = sphere(6000, 1, center);
        const Lattice l = lattice_around(bounding_box(s.points), 0.2, cells);
        WindingField field(l);
        field.solve(s.points, s.vectors, 12);
        const LatticeField& chi = field.indicator();
        double worst_in = 0, worst_out = 0, worst_on = 0, least_cosine = 1;
        for (const Vec3& direction : test::sphere_cloud(400, 1, 7)) {
            const auto at = [&](double r) { return chi.at(test::sum(center, test::scaled(r, direction))); };
            worst_in = std::max({worst_in, std::abs(at(0).value - 1), std::abs(at(1 - 3 * l.cell).value - 1)});
            worst_out = std::max(worst_out, std::abs(at(1 + 3 * l.cell).value));
            worst_on = std::max(worst_on, std::abs(at(1).value - 0.5));
            const Vec3 g = at(1).gradient;
            least_cosine = std::min(least_cosine, -test::dot(g, direction) / test::norm(g));
        }
        INFO(cells << " cells: in " << worst_in << " out " << worst_out << " on " << worst_on << " cosine "
                   << least_cosine);
        CHECK(worst_in < 0.02);
        CHECK(worst_out < 0.02);
        CHECK(worst_on < 0.06);
        CHECK(least_cosine > 0.99);
    }
}

TEST_CASE("the indicator steps by 1 across a surface that encloses nothing") {
    const Charged whole = sphere(8000, 1);
    Charged bowl;
    for (std::size_t n = 0; n < whole.points.size(); ++n) {
        if (whole.points[n][2] > 0) continue;
        bowl.points.push_back(whole.points[n]);
        bowl.vectors.push_back(whole.vectors[n]);
    }
    WindingField field(lattice_around(bounding_box(whole.points), 0.2, 64));
    field.solve(bowl.points, bowl.vectors, 12);
    const double cell = field.indicator().lattice.cell;
    // Away from both sides the harmonic part changes, too: of a disc's by about the distance over the radius.
    for (const double r : {2.0, 3.0}) {
        const double step =
            field.indicator().at({0, 0, -1 + r * cell}).value - field.indicator().at({0, 0, -1 - r * cell}).value;
        CHECK(step > 1 - 2 * r * cell);
        CHECK(step < 1.02);
    }
    CHECK(field.indicator().at({0, 0, 0.9}).value < 0.4);
}

TEST_CASE("each V-cycle leaves a fraction of the error") {
    const Charged s = sphere(4000, 1);
    const Lattice l = lattice_around(bounding_box(s.points), 0.2, 48);
    WindingField exact(l);
    exact.solve(s.points, s.vectors, 30);
    WindingField field(l);
    double before = largest_difference(field.indicator(), exact.indicator());
    CHECK(before > 0.9);
    for (int cycle = 0; cycle < 4; ++cycle) {
        field.solve(s.points, s.vectors, 1);
        const double now = largest_difference(field.indicator(), exact.indicator());
        INFO("cycle " << cycle << ": " << before << " to " << now);
        CHECK(now < 0.35 * before);
        before = now;
    }
    // Going on is what more cycles at once are.
    WindingField at_once(l);
    at_once.solve(s.points, s.vectors, 4);
    CHECK(at_once.indicator().values == field.indicator().values);
}

TEST_CASE("a coarser solution is a good first guess for a finer one") {
    const Charged s = sphere(4000, 1);
    const WorldBox box = bounding_box(s.points);
    WindingField coarse(lattice_around(box, 0.2, 32)), exact(lattice_around(box, 0.2, 48)),
        fresh(lattice_around(box, 0.2, 48)), guessed(lattice_around(box, 0.2, 48));
    coarse.solve(s.points, s.vectors, 12);
    exact.solve(s.points, s.vectors, 30);
    guessed.start_from(coarse.indicator());
    double inside = 0;
    for (const Vec3& x : test::box_cloud(100, {{-0.4, -0.4, -0.4}, {0.4, 0.4, 0.4}}, 3))
        inside = std::max(inside, std::abs(guessed.indicator().at(x).value - 1));
    CHECK(inside < 0.02);
    fresh.solve(s.points, s.vectors, 1);
    guessed.solve(s.points, s.vectors, 1);
    CHECK(largest_difference(guessed.indicator(), exact.indicator()) <
          0.7 * largest_difference(fresh.indicator(), exact.indicator()));
}

TEST_CASE("the indicator is linear in the areas; multiply scales it; turned normals change its sign") {
    const Charged s = sphere(1000, 1);
    const Lattice l = lattice_around(bounding_box(s.points), 0.2, 32);
    Charged turned = s;
    for (Vec3& v : turned.vectors) v = test::scaled(-2, v);
    WindingField field(l), other(l);
    field.solve(s.points, s.vectors, 5);
    other.solve(turned.points, turned.vectors, 5);
    field.multiply(-2);
    CHECK(largest_difference(field.indicator(), other.indicator()) < 1e-4);
    CHECK(field.indicator().at({0, 0, 0}).value < -1.9);
    // The boundary stays 0.
    double end = 0;
    for_nodes(l, [&](std::size_t n, const Vec3& x) {
        for (int a = 0; a < 3; ++a) {
            const double at = (x[a] - l.origin[a]) / l.cell;
            if (at < 0.5 || at > l.nodes[a] - 1.5) end = std::max(end, double(std::abs(field.indicator().values[n])));
        }
    });
    CHECK(end == 0);
}
