#include "covol/contours.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "contours/contour_curve.h"
#include "contours/slice_field.h"
#include "covol/error.h"
#include "support/scratch.h"
#include "unit/contours/drawing.h"

using namespace covol;
using namespace covol::test;

// ---- along the lines ------------------------------------------------------------------------------------------------

TEST_CASE("An open line is sampled along its length and encloses nothing") {
    Drawing drawing(cube(40));
    const std::vector<Vec3> marks{{3, 4, 10}, {13, 4, 10}, {13, 11, 10}};
    const Contours c = drawing.add(marks, false).densify(0.5);
    CHECK(c.solid == nullptr);
    CHECK(c.between.empty());
    CHECK((c.open == 1 && c.closed == 0 && c.slices == 0));
    CHECK(c.marks == marks);
    CHECK(c.along.size() == 20 + 14 + 1);  // 17 units of length in steps of 0.5, and the end
    for (const Vec3& p : c.along) CHECK(std::min(std::abs(p[1] - 4), std::abs(p[0] - 13)) < 1e-12);
    for (const Vec3& mark : marks) CHECK(nearest(mark, c.along) < 1e-12);
    for (std::size_t n = 0; n + 1 < c.along.size(); ++n) CHECK(distance(c.along[n], c.along[n + 1]) <= 0.5 + 1e-12);
}

TEST_CASE("A closed line is sampled also from its last mark to the first") {
    Drawing drawing(cube(40));
    const Contours c = drawing.add({{10, 10, 5}, {20, 10, 5}, {20, 20, 5}, {10, 20, 5}}).densify(1);
    CHECK(c.along.size() == 40);
    CHECK(nearest({10, 15, 5}, c.along) < 1e-12);
    CHECK((c.closed == 1 && c.slices == 1));
}

TEST_CASE("Points that belong to no line are marks") {
    Drawing drawing(cube(40));
    const Contours c = drawing.circle(20, 20, 10, 5).loose({2, 3, 4}).densify(1);
    CHECK(nearest({2, 3, 4}, c.along) == 0);
    CHECK(c.marks.size() == 97);
}

TEST_CASE("A spline through 12 marks of a circle deviates less than a fifth as much as straight lines") {
    const double r = 12;
    const auto radii = [&](ContourCurve curve) {
        const Contours c = Drawing(cube(40)).circle(20, 20, 10, r, 2, 12).densify(0.25, curve);
        double worst = 0;
        for (const Vec3& p : c.along) worst = std::max(worst, std::abs(std::hypot(p[0] - 20, p[1] - 20) - r));
        return worst;
    };
    CHECK(radii(ContourCurve::Lines) == Approx(r * (1 - std::cos(kPi / 12))).epsilon(0.01));
    CHECK(radii(ContourCurve::Spline) < 0.2 * r * (1 - std::cos(kPi / 12)));
}

TEST_CASE("The centripetal curve passes through its marks and stays on a straight line") {
    const std::vector<Vec3> marks{{0, 0, 0}, {1, 0, 0}, {1.2, 2, 0}, {-1, 3, 0}};
    for (const bool closed : {false, true}) {
        const std::vector<Vec3> curve = detail::centripetal_curve(marks, closed, 0.1);
        for (const Vec3& mark : marks) CHECK(nearest(mark, curve) < 1e-12);
    }
    for (const Vec3& p : detail::centripetal_curve({{0, 0, 0}, {1, 1, 0}, {5, 5, 0}, {6, 6, 0}}, false, 0.1))
        CHECK(std::abs(p[0] - p[1]) < 1e-12);
}

// ---- within a slice -------------------------------------------------------------------------------------------------

TEST_CASE("The signed distance to polygons is exact") {
    const detail::Polygon outer{{0, 0}, {20, 0}, {20, 20}, {0, 20}}, inner{{5, 5}, {15, 5}, {15, 15}, {5, 15}};
    const detail::SliceGrid grid{{-4, -4}, 0.5, 57, 57};
    const std::vector<float> level = detail::signed_distance_of_polygons({outer, inner}, grid);
    const auto box_distance = [](double x, double y, double low, double high) {
        const double dx = std::max(low - x, x - high), dy = std::max(low - y, y - high);
        return std::hypot(std::max(dx, 0.0), std::max(dy, 0.0)) + std::min(std::max(dx, dy), 0.0);
    };
    double worst = 0;
    for (int j = 0; j < grid.ny; ++j)
        for (int i = 0; i < grid.nx; ++i) {
            const double x = -4 + 0.5 * i, y = -4 + 0.5 * j;
            const double expected = std::max(box_distance(x, y, 0, 20), -box_distance(x, y, 5, 15));
            worst = std::max(worst, std::abs(expected - double(level[std::size_t(j) * 57 + std::size_t(i)])));
        }
    CHECK(worst < 1e-5);
}

TEST_CASE("A polygon's moments do not depend on its orientation or its distance from the origin") {
    for (const double at : {0.0, 1e6}) {
        detail::Polygon triangle{{at, at}, {at + 6, at}, {at, at + 3}};
        for (int turn = 0; turn < 2; ++turn) {
            const detail::PolygonMoments m = detail::moments(triangle);
            CHECK(m.area == Approx(9));
            CHECK(m.centroid[0] - at == Approx(2));
            CHECK(m.centroid[1] - at == Approx(1));
            std::reverse(triangle.begin(), triangle.end());
        }
    }
}

TEST_CASE("A contour within another one is a hole, and a contour within the hole is solid") {
    Drawing drawing(cube(60));
    for (int k = 20; k <= 30; ++k) drawing.circle(30, 30, k, 20).circle(30, 30, k, 12).circle(30, 30, k, 4);
    const Contours c = drawing.densify(1);
    for (const double k : {20.0, 23.5, 30.0}) {
        CHECK(c.solid->level({30, 30, k}) < -3);
        CHECK(c.solid->level({38, 30, k}) == Approx(4).margin(0.1));
        CHECK(c.solid->level({30, 46, k}) == Approx(-4).margin(0.1));
        CHECK(c.solid->level({30, 55, k}) == Approx(5).margin(0.1));
    }
    const std::vector<Vec3> seeds = c.solid->hole_seeds();
    REQUIRE(seeds.size() == 11);
    for (const Vec3& seed : seeds) CHECK(std::hypot(seed[0] - 30, seed[1] - 30) == Approx(8).margin(1));
}

TEST_CASE("Several contours in a slice are separate parts, which join a larger contour in the next slice") {
    Drawing drawing(cube(60));
    for (int k = 10; k <= 14; ++k) drawing.circle(18, 30, k, 8).circle(42, 30, k, 8);
    for (int k = 15; k <= 20; ++k) drawing.circle(30, 30, k, 22);
    const Contours c = drawing.densify(1);
    CHECK(c.solid->level({18, 30, 12}) < 0);
    CHECK(c.solid->level({42, 30, 12}) < 0);
    CHECK(c.solid->level({30, 30, 12}) > 0);
    CHECK(c.solid->level({30, 30, 17}) < 0);
    CHECK(flood(all_points(c), 1, 1.5).leaks == false);
}

// ---- hostile input --------------------------------------------------------------------------------------------------

TEST_CASE("densify: invalid contours and steps are rejected, and the message names the contour") {
    CHECK(code_of([] { (void)densify({}, {1}); }) == Errc::InvalidInput);
    const Drawing loose = Drawing(cube(40)).loose({1, 2, 3});
    CHECK(message_of([&] { (void)loose.densify(1); }).find("marks.csv: expected lines of marks") != std::string::npos);
    for (const double step : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
        CHECK(code_of([&] { (void)Drawing(cube(40)).circle(20, 20, 5, 3).densify(step); }) == Errc::InvalidOptions);
    }
    const Drawing crooked = Drawing(cube(40)).add({{1, 2, 3}, {10, 2, 5}, {5, 9, 8}, {3, 6, 20}});
    CHECK(message_of([&] { (void)crooked.densify(1); }).find("marks.csv: contour 1: expected marks in one plane") !=
          std::string::npos);
    const Drawing outside = Drawing(cube(40)).circle(20, 20, 5, 3).circle(38, 20, 6, 5);
    const std::string why = message_of([&] { (void)outside.densify(1); });
    CHECK(why.find("contour 2") != std::string::npos);
    CHECK(why.find("outside the image") != std::string::npos);
}

TEST_CASE("Contours in planes of several directions are a network with directions out of the sections") {
    const auto square = [](double low, double high, double slope) {  // in planes through the centre, (20, 20, 20)
        std::vector<Vec3> marks;
        for (const auto& [x, y] : {std::pair{low, low}, {high, low}, {high, high}, {low, high}})
            marks.push_back({x, y, 20 + slope * (x - 20)});
        return marks;
    };
    const Contours network = Drawing(cube(40))
                                 .add(square(10, 30, 0.5))
                                 .add(square(15, 25, 0.5))
                                 .add(square(10, 30, -0.25))
                                 .add(square(15, 25, -0.25))
                                 .densify(1, ContourCurve::Lines);
    CHECK(network.is_network);
    CHECK(network.solid == nullptr);
    CHECK(network.slices == 2);
    REQUIRE(network.outward.size() == network.along.size());
    const auto is_in_ring = [](const Vec3& p) {
        const double off = std::max(std::abs(p[0] - 20), std::abs(p[1] - 20));
        return off > 5 && off < 10;
    };
    for (std::size_t n = 0; n < network.along.size(); ++n) {
        Vec3 in = network.along[n], out = in;
        for (int a = 0; a < 3; ++a) {
            in[a] -= 0.1 * network.outward[n][a];
            out[a] += 0.1 * network.outward[n][a];
        }
        CHECK((is_in_ring(in) && !is_in_ring(out)));
    }
    REQUIRE_FALSE((network.inside.empty() || network.outside.empty()));
    for (const Vec3& p : network.inside) CHECK(is_in_ring(p));
    for (const Vec3& p : network.outside) CHECK_FALSE(is_in_ring(p));
    // Contours in parallel planes that are tilted against the image are no network: they make a body in slices along
    // the normal of these planes.
    std::vector<Vec3> other = square(10, 30, 0.5);
    for (Vec3& p : other) p[2] += 6;
    const Contours tilted = Drawing(cube(40)).add(square(10, 30, 0.5)).add(other).densify(1);
    CHECK_FALSE(tilted.is_network);
    REQUIRE(tilted.solid != nullptr);
    CHECK(tilted.slices == 2);
    CHECK(std::abs(tilted.slice_distance - 6 / std::sqrt(1.25)) < 1e-6);
    CHECK(tilted.solid->level({20, 20, 23}) < 0);
    CHECK(tilted.solid->level({20, 32, 23}) > 0);
}

TEST_CASE("Contours of one, two, collinear or equal marks enclose nothing, and repeated marks change nothing") {
    const Contours one = Drawing(cube(40)).add({{5, 6, 7}}).densify(1);
    CHECK(one.solid == nullptr);
    CHECK(one.along.size() == 1);
    const Contours two = Drawing(cube(40)).add({{5, 6, 7}, {9, 6, 7}}).densify(1);
    CHECK((two.open == 1 && two.closed == 0));
    CHECK(two.along.size() == 5);
    const Contours flat = Drawing(cube(40)).add({{5, 6, 7}, {9, 6, 7}, {15, 6, 7}}).densify(1);
    CHECK(flat.solid == nullptr);
    const Contours same = Drawing(cube(40)).add({{5, 6, 7}, {5, 6, 7}, {5, 6, 7}}).densify(1);
    CHECK(same.solid == nullptr);
    CHECK(same.along.size() == 1);
    std::vector<Vec3> square{{5, 5, 7}, {15, 5, 7}, {15, 15, 7}, {5, 15, 7}};
    const Contours plain = Drawing(cube(40)).add(square).densify(1);
    square = {{5, 5, 7}, {5, 5, 7}, {15, 5, 7}, {15, 15, 7}, {15, 15, 7}, {15, 15, 7}, {5, 15, 7}, {5, 5, 7}};
    for (const ContourCurve curve : {ContourCurve::Lines, ContourCurve::Spline}) {
        const Contours repeated = Drawing(cube(40)).add(square).densify(1, curve);
        for (const Vec3& p : all_points(repeated))
            CHECK((std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2])));
        if (curve == ContourCurve::Lines) CHECK(repeated.along == plain.along);
    }
}

TEST_CASE("A self-intersecting contour encloses both of its lobes") {
    const Contours c = Drawing(cube(60)).add({{10, 10, 5}, {40, 40, 5}, {40, 10, 5}, {10, 40, 5}}).densify(1);
    CHECK(c.solid->level({13, 25, 5}) < 0);
    CHECK(c.solid->level({37, 25, 5}) < 0);
    CHECK(c.solid->level({25, 13, 5}) > 0);
    CHECK(c.solid->level({25, 37, 5}) > 0);
}

TEST_CASE("A repeated contour counts once and causes a warning") {
    Drawing drawing(cube(60));
    for (int k = 10; k <= 14; ++k) drawing.circle(30, 30, k, 10).circle(30, 30, k, 10);
    Warnings warnings;
    const Contours c = drawing.densify(1, ContourCurve::Lines, warnings.run);
    REQUIRE(c.solid != nullptr);
    CHECK(c.solid->level({30, 30, 12}) == Approx(-10).margin(0.1));
    REQUIRE(warnings.lines.size() == 1);
    CHECK(warnings.lines[0].find("5 contours repeat the marks") != std::string::npos);
}

TEST_CASE("Slices are across the axis with most contours, and contours in other planes count as marks") {
    Drawing drawing(cube(60));
    for (int k = 20; k <= 40; k += 4) drawing.circle(30, 30, k, 12, 1);
    drawing.circle(30, 30, 30, 10, 0);
    const Contours c = drawing.densify(1);
    CHECK(c.summary.find("across y") != std::string::npos);
    CHECK(c.slices == 6);
    CHECK(c.closed == 7);
    CHECK(nearest({30, 40, 30}, c.along) < 1e-9);
    CHECK(c.solid->level({30, 30, 30}) < 0);
}

TEST_CASE("Contours in world coordinates need no image") {
    Drawing drawing(cube(60));
    for (int k = 10; k <= 20; ++k) drawing.circle(30, 30, k, 10);
    PointCloud world = drawing.cloud();
    world.space = PointSpace::World;
    const Contours c = densify({world}, {0.5});
    CHECK(c.slices == 11);
    CHECK(c.solid->level({40, 30, 14.5}) == Approx(0).margin(0.02));
}
