#include "cloud/poisson/winding_field.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "cloud/indicator/indicator.h"
#include "covol/points.h"
#include "support/clouds.h"
#include "support/surface_samples.h"

using namespace covol;
using namespace covol::cloud;

namespace {

/// Points of a sphere with their area vectors (area times normal).
struct OrientedSphere {
    std::vector<Vec3> points, vectors;
};

/// Points that are spread evenly over a sphere, along a spiral.
OrientedSphere sphere(int count, double radius, const Vec3& center = {0, 0, 0}) {
    OrientedSphere s;
    for (int m = 0; m < count; ++m) {
        const double z = 1 - (2 * m + 1.0) / count, r = std::sqrt(1 - z * z), angle = m * M_PI * (3 - std::sqrt(5.0));
        const Vec3 n{r * std::cos(angle), r * std::sin(angle), z};
        s.points.push_back(test::sum(center, test::scaled(radius, n)));
        s.vectors.push_back(test::scaled(4 * M_PI * radius * radius / count, n));
    }
    return s;
}

using Stack = std::shared_ptr<const GridStack>;

/// A stack of grids with all points on the finest grid, which has about `cells` cells along the longest side. This side
/// includes the margin of `fraction` of its length at both ends of the points.
Stack grids(const std::vector<Vec3>& points, int cells, double fraction = 0.2) {
    return std::make_shared<const GridStack>(points, std::vector<std::uint8_t>{},
                                             longest_side(bounding_box(points)) * (1 + 2 * fraction) / cells, fraction);
}

double largest_difference(const StackField& a, const StackField& b) {
    double largest = 0;
    for (std::size_t l = 0; l < a.values.size(); ++l)
        for (std::size_t n = 0; n < a.values[l].size(); ++n)
            largest = std::max(largest, double(std::abs(a.values[l][n] - b.values[l][n])));
    return largest;
}

/// Calls visit(value, place, cell) for each node of each level; `cell` is the edge of the level's cells.
template <typename Field, typename Visit>
void for_nodes(Field& field, Visit visit) {
    const GridStack& stack = field.stack();
    for (std::size_t l = 0; l < field.values.size(); ++l)
        for (std::size_t n = 0; n < field.values[l].size(); ++n) {
            const GridLevel& level = stack.levels()[l];
            const BlockAt& at = level.blocks[n / kBlockNodes];
            const int in[3] = {int(n / 64 % 8), int(n / 8 % 8), int(n % 8)};
            Vec3 place = stack.origin();
            for (int a = 0; a < 3; ++a) place[a] += level.cell * (8.0 * at[std::size_t(a)] + in[a]);
            visit(field.values[l][n], place, level.cell);
        }
}

/// Random points in a box. The grid around those with x < 0 is two levels coarser than around the others.
struct UnevenCloud {
    UnevenCloud() {
        for (const Vec3& p : points) levels.push_back(p[0] < 0 ? 2 : 0);
        stack = std::make_shared<const GridStack>(points, levels, 0.01, 0.2);
    }
    std::vector<Vec3> points = test::box_cloud(3000, {{-1, -0.6, -0.05}, {1, 0.6, 0.05}}, 4);
    std::vector<std::uint8_t> levels;
    Stack stack;
};

}  // namespace

TEST_CASE("GridStack: each level has all nodes around its points, and every block has a coarser one") {
    const UnevenCloud u;
    const std::vector<GridLevel>& levels = u.stack->levels();
    for (std::size_t n = 0; n < u.points.size(); ++n)
        for (std::size_t l = u.levels[n]; l < levels.size(); ++l)
            for (int corner = 0; corner < 8; ++corner) {
                BlockAt at{};
                for (std::size_t a = 0; a < 3; ++a)
                    at[a] = int(std::floor((u.points[n][int(a)] - u.stack->origin()[int(a)]) / levels[l].cell) +
                                ((corner >> a & 1) != 0 ? 2 : -1)) >>
                            3;
                // The coarsest level is one block, so that level l has blocks from 0 to `end` - 1 along each axis.
                const int end = 1 << (levels.size() - 1 - l);
                if (std::all_of(at.begin(), at.end(), [&](int x) { return x >= 0 && x < end; }))
                    REQUIRE(levels[l].find(at) != kNoBlock);
            }
    CHECK(levels[0].blocks.size() > 500);
    for (std::size_t l = 0; l + 1 < levels.size(); ++l)
        for (std::size_t n = 0; n < levels[l].blocks.size(); ++n) {
            const BlockAt& at = levels[l].blocks[n];
            REQUIRE(levels[l].find(at) == n);
            REQUIRE(levels[l].coarser[n] != kNoBlock);
            REQUIRE(levels[l + 1].blocks[levels[l].coarser[n]] == BlockAt{at[0] >> 1, at[1] >> 1, at[2] >> 1});
        }
    // The coarse half has fine blocks only near the boundary between the halves.
    for (const BlockAt& at : levels[0].blocks) REQUIRE(u.stack->origin()[0] + 0.08 * (at[0] + 1) > -0.15);
}

TEST_CASE("Splines reproduce linear functions across levels, and gradients are the derivatives of values") {
    const UnevenCloud u;
    StackField linear(u.stack), waves(u.stack);
    for_nodes(linear, [](float& value, const Vec3& x, double) { value = float(0.3 + 2 * x[0] - x[1] + 0.5 * x[2]); });
    for_nodes(waves, [](float& value, const Vec3& x, double) {
        value = float(std::sin(3 * x[0]) * std::cos(2 * x[1]) + x[2] * x[0]);
    });
    std::size_t coarse = 0;
    for (const Vec3& x : test::box_cloud(600, {{-1, -0.8, -0.3}, {1, 0.8, 0.3}}, 2)) {
        const StackField::Sample s = linear.at(x);
        REQUIRE(s.value == Approx(0.3 + 2 * x[0] - x[1] + 0.5 * x[2]).margin(2e-6));
        REQUIRE(linear.value_at(x) == Approx(s.value).margin(1e-12));
        coarse += s.cell > 0.01;
        const Vec3 slope{2, -1, 0.5};
        const double step = 0.05 * s.cell;
        for (int a = 0; a < 3; ++a) {
            // The margin allows for the rounding errors of float values, divided by a cell of 0.01.
            REQUIRE(s.gradient[a] == Approx(slope[a]).margin(1e-3));
            Vec3 low = x, high = x;
            low[a] -= step;
            high[a] += step;
            if (waves.at(low).cell != waves.at(high).cell) continue;
            REQUIRE(waves.at(x).gradient[a] ==
                    Approx((waves.at(high).value - waves.at(low).value) / (2 * step)).margin(2e-3));
        }
    }
    CHECK(coarse > 200);
    // Beyond the grids the value is that at their end.
    CHECK(std::isfinite(linear.at({100, -100, 3}).value));
    CHECK(linear.at({100, 0, 0}).value == linear.at({1000, 0, 0}).value);
}

TEST_CASE("spread: the density preserves the number of the points and their centroid") {
    const std::vector<Vec3> points = test::box_cloud(500, {{-1, -0.4, 0}, {1, 0.8, 0.3}}, 3);
    const StackField density = spread(grids(points, 48, 0.5), points, std::vector<double>(points.size(), 1.0));
    double count = 0;
    Vec3 mean{0, 0, 0}, center{0, 0, 0};
    for (const Vec3& p : points) center = test::sum(center, test::scaled(1.0 / 500, p));
    for_nodes(density, [&](float value, const Vec3& x, double) {
        REQUIRE(value >= 0);
        count += double(value);
        mean = test::sum(mean, test::scaled(double(value) / 500, x));
    });
    CHECK(count == Approx(500).epsilon(1e-4));
    for (int a = 0; a < 3; ++a) CHECK(mean[a] == Approx(center[a]).margin(1e-4));
}

namespace {

/// The equation is solved with the gradient of a bell-shaped function, given at points that fill a box, so that the
/// solution should be this function. @return the maximum error
double error_of_bell(double cell, bool uneven) {
    constexpr double kWidth = 0.25;
    const int side = int(std::lround(2.4 / (0.5 * cell)));  // two points per cell along each axis
    std::vector<Vec3> points, vectors;
    std::vector<std::uint8_t> levels;
    const double step = 2.4 / side;
    for (int n = 0; n < side * side * side; ++n) {
        const Vec3 x{-1.2 + (n / side / side + 0.5) * step, -1.2 + (n / side % side + 0.5) * step,
                     -1.2 + (n % side + 0.5) * step};
        const double bell = std::exp(-0.5 * test::dot(x, x) / (kWidth * kWidth));
        points.push_back(x);
        vectors.push_back(test::scaled(bell / (kWidth * kWidth) * step * step * step, x));
        levels.push_back(uneven && x[0] + 0.3 * x[1] < 0.1 ? 1 : 0);
    }
    WindingField field(std::make_shared<const GridStack>(points, levels, cell, 0.2));
    field.solve(points, vectors, 20);
    double worst = 0;
    for (const Vec3& x : test::box_cloud(1000, {{-0.8, -0.8, -0.8}, {0.8, 0.8, 0.8}}, 5))
        worst = std::max(
            worst, std::abs(field.indicator().value_at(x) - std::exp(-0.5 * test::dot(x, x) / (kWidth * kWidth))));
    return worst;
}

}  // namespace

TEST_CASE("Halving the cell size reduces the error to less than 0.36, also across a change of levels") {
    for (const bool uneven : {false, true}) {
        const double coarse = error_of_bell(0.1, uneven), fine = error_of_bell(0.05, uneven);
        INFO((uneven ? "two levels: " : "one level: ") << coarse << " then " << fine);
        CHECK(coarse < (uneven ? 0.35 : 0.2));
        CHECK(fine < 0.36 * coarse);
    }
}

TEST_CASE("Grids near the points give the same indicator as grids that fill the box") {
    const OrientedSphere s = sphere(4000, 1);
    std::vector<Vec3> all = s.points, vectors = s.vectors;
    for (const Vec3& p : test::box_cloud(40000, {{-1.35, -1.35, -1.35}, {1.35, 1.35, 1.35}}, 9)) {
        all.push_back(p);
        vectors.push_back({0, 0, 0});
    }
    const double cell = 2.8 / 48;
    WindingField near(std::make_shared<const GridStack>(s.points, std::vector<std::uint8_t>{}, cell, 0.2)),
        everywhere(std::make_shared<const GridStack>(all, std::vector<std::uint8_t>{}, cell, 0.04));
    CHECK(near.indicator().stack().levels()[0].blocks.size() <
          0.8 * double(everywhere.indicator().stack().levels()[0].blocks.size()));
    near.solve(s.points, s.vectors, 15);
    everywhere.solve(all, vectors, 15);
    for (const Vec3& x : test::box_cloud(2000, {{-1.1, -1.1, -1.1}, {1.1, 1.1, 1.1}}, 6))
        REQUIRE(near.indicator().value_at(x) == Approx(everywhere.indicator().value_at(x)).margin(0.03));
}

TEST_CASE("A few points far away add few blocks and do not change the indicator") {
    const OrientedSphere s = sphere(40000, 1);
    const double cell = 0.016;
    const auto alone = std::make_shared<const GridStack>(s.points, std::vector<std::uint8_t>{}, cell, 0.2);
    OrientedSphere with = s;
    for (const Vec3& way : test::sphere_cloud(10, 1e5, 3)) {
        with.points.push_back(way);
        with.vectors.push_back({0, 0, 0});
    }
    std::vector<double> areas(s.points.size(), 4 * M_PI / 40000);
    areas.resize(with.points.size(), 1e9);
    const auto with_areas = indicator_grid(with.points, areas, cell);
    CHECK(with_areas->block_count() < 1.2 * double(alone->block_count()));
    WindingField field(with_areas);
    field.solve(with.points, with.vectors, 20);
    CHECK(field.indicator().value_at({0, 0, 0}) == Approx(1).margin(0.02));
    CHECK(std::abs(field.indicator().value_at({1.5, 0, 0})) < 0.02);
}

TEST_CASE("The indicator is bit-identical on any number of threads") {
    const UnevenCloud u;
    std::vector<Vec3> vectors;
    for (const Vec3& p : u.points) vectors.push_back(test::scaled(0.001, p));
    std::vector<StackField> results;
    for (const int threads : {1, 2, 5}) {
        RunContext run;
        run.threads = threads;
        with_threads(run, [&] {
            WindingField field(u.stack);
            field.screen(u.points, std::vector<double>(u.points.size(), 0.5));
            field.solve(u.points, vectors, 3);
            results.push_back(field.indicator());
        });
    }
    CHECK(results[0].values == results[1].values);
    CHECK(results[0].values == results[2].values);
}

TEST_CASE("The indicator of a sphere is 1 inside, 0 outside, 1/2 on it, and rises inward") {
    for (const int cells : {32, 64}) {
        const Vec3 center{3.03, -2.01, 0.02};
        const OrientedSphere s = sphere(6000, 1, center);
        const Stack stack = grids(s.points, cells);
        WindingField field(stack);
        field.solve(s.points, s.vectors, 12);
        const StackField& chi = field.indicator();
        const double cell = stack->cell();
        double worst_in = 0, worst_out = 0, worst_on = 0, min_cosine = 1;
        for (const Vec3& direction : test::sphere_cloud(400, 1, 7)) {
            const auto at = [&](double r) { return chi.at(test::sum(center, test::scaled(r, direction))); };
            worst_in = std::max({worst_in, std::abs(at(0).value - 1), std::abs(at(1 - 3 * cell).value - 1)});
            worst_out = std::max(worst_out, std::abs(at(1 + 3 * cell).value));
            worst_on = std::max(worst_on, std::abs(at(1).value - 0.5));
            const Vec3 g = at(1).gradient;
            min_cosine = std::min(min_cosine, -test::dot(g, direction) / test::norm(g));
        }
        INFO(cells << " cells: in " << worst_in << " out " << worst_out << " on " << worst_on << " cosine "
                   << min_cosine);
        CHECK(worst_in < 0.02);
        CHECK(worst_out < 0.02);
        CHECK(worst_on < 0.06);
        CHECK(min_cosine > 0.99);
    }
}

TEST_CASE("The indicator changes by 1 across an open surface") {
    const OrientedSphere whole = sphere(8000, 1);
    OrientedSphere bowl;
    for (std::size_t n = 0; n < whole.points.size(); ++n) {
        if (whole.points[n][2] > 0) continue;
        bowl.points.push_back(whole.points[n]);
        bowl.vectors.push_back(whole.vectors[n]);
    }
    WindingField field(std::make_shared<const GridStack>(bowl.points, std::vector<std::uint8_t>{}, 2.8 / 64, 0.2));
    field.solve(bowl.points, bowl.vectors, 12);
    const double cell = field.indicator().stack().cell();
    // The solution also changes away from the surface, on both sides: for a disc by about the distance over the radius.
    // Therefore the step is measured close to the surface and may be smaller by this amount.
    for (const double r : {2.0, 3.0}) {
        const double step =
            field.indicator().at({0, 0, -1 + r * cell}).value - field.indicator().at({0, 0, -1 - r * cell}).value;
        CHECK(step > 1 - 2 * r * cell);
        CHECK(step < 1.02);
    }
    CHECK(field.indicator().at({0, 0, 0.9}).value < 0.4);
}

TEST_CASE("Each V-cycle reduces the error to less than 0.35, and cycles can be continued later") {
    const OrientedSphere s = sphere(4000, 1);
    const Stack l = grids(s.points, 48);
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
    // Further cycles after an interruption give the same result as all cycles at once.
    WindingField at_once(l);
    at_once.solve(s.points, s.vectors, 4);
    CHECK(at_once.indicator().values == field.indicator().values);
}

TEST_CASE("A coarser solution as initial value reduces the error after one V-cycle") {
    const OrientedSphere s = sphere(4000, 1);
    const Stack fine = grids(s.points, 48);
    WindingField coarse(grids(s.points, 32)), exact(fine), cold_start(fine), warm_start(fine);
    coarse.solve(s.points, s.vectors, 12);
    exact.solve(s.points, s.vectors, 30);
    warm_start.start_from(coarse.indicator());
    double inside = 0;
    for (const Vec3& x : test::box_cloud(100, {{-0.4, -0.4, -0.4}, {0.4, 0.4, 0.4}}, 3))
        inside = std::max(inside, std::abs(warm_start.indicator().at(x).value - 1));
    CHECK(inside < 0.02);
    cold_start.solve(s.points, s.vectors, 1);
    warm_start.solve(s.points, s.vectors, 1);
    CHECK(largest_difference(warm_start.indicator(), exact.indicator()) <
          0.7 * largest_difference(cold_start.indicator(), exact.indicator()));
}

TEST_CASE("The indicator is linear in the area vectors, and multiply() scales it") {
    const OrientedSphere s = sphere(1000, 1);
    const Stack l = grids(s.points, 32);
    OrientedSphere turned = s;
    for (Vec3& v : turned.vectors) v = test::scaled(-2, v);
    WindingField field(l), other(l);
    field.solve(s.points, s.vectors, 5);
    other.solve(turned.points, turned.vectors, 5);
    field.multiply(-2);
    CHECK(largest_difference(field.indicator(), other.indicator()) < 1e-4);
    CHECK(field.indicator().at({0, 0, 0}).value < -1.9);
}
