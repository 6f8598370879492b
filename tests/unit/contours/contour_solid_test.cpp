#include <openvdb/openvdb.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "covol/contours.h"
#include "covol/start.h"
#include "unit/contours/drawing.h"

// The body that contours on slices enclose, and the start from it.

using namespace covol;
using namespace covol::test;

namespace {

/// An image geometry with rotated axes, along each of which size, spacing and origin differ.
ImageGeometry turned_geometry() {
    ImageGeometry g;
    g.size = {80, 100, 80};
    g.spacing = {0.5, 0.4, 1.0};
    g.origin = {12, -31, 207};
    const double c = std::cos(0.3), s = std::sin(0.3);
    g.direction = {{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}};
    return g;
}

/// The volume by a Riemann sum over the box of the body, with cubes of edge `step`.
double volume(const ContourSolid& solid, double step) {
    const WorldBox box = solid.box();
    double count = 0;
    for (double x = box.min[0] + step / 2; x < box.max[0]; x += step)
        for (double y = box.min[1] + step / 2; y < box.max[1]; y += step)
            for (double z = box.min[2] + step / 2; z < box.max[2]; z += step) count += solid.level({x, y, z}) < 0;
    return count * step * step * step;
}

/// The maximum distance of a position on the surface from the nearest point, on random rays from `inside`.
double widest_gap(const ContourSolid& solid, const std::vector<Vec3>& points, const Vec3& inside, double far) {
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    double widest = 0;
    for (int n = 0; n < 600; ++n) {
        Vec3 d{normal(random), normal(random), normal(random)};
        const double length = std::hypot(d[0], d[1], d[2]);
        double low = 0, high = far;
        for (int round = 0; round < 40; ++round) {
            const double t = (low + high) / 2;
            const bool in = solid.level({inside[0] + t * d[0] / length, inside[1] + t * d[1] / length,
                                         inside[2] + t * d[2] / length}) < 0;
            (in ? low : high) = t;
        }
        widest = std::max(widest, nearest({inside[0] + low * d[0] / length, inside[1] + low * d[1] / length,
                                           inside[2] + low * d[2] / length},
                                          points));
    }
    return widest;
}

}  // namespace

// ---- between slices -------------------------------------------------------------------------------------------------

TEST_CASE("A cylinder's level is the distance to its wall for slices across each axis of a rotated image") {
    for (const int axis : {0, 1, 2}) {
        ImageGeometry g = turned_geometry();
        std::swap(g.spacing[axis], g.spacing[2]);
        const double r = 9, step = 0.4;
        Drawing drawing(g);
        for (int k = 20; k <= 30; ++k) drawing.circle(40, 45, k, r, axis);
        const Contours c = drawing.densify(step);
        INFO("axis " << axis);
        REQUIRE(c.solid != nullptr);
        CHECK(c.slices == 11);
        CHECK(c.slice_distance == Approx(1));
        const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
        std::mt19937 random(3);
        std::uniform_real_distribution<double> angle(0, 2 * kPi), radius(0.8 * r, 1.15 * r), height(20, 30);
        for (int n = 0; n < 200; ++n) {
            const double t = angle(random), rho = radius(random);
            Vec3 p;
            p[axis] = height(random);
            p[u] = 40 + rho * std::cos(t) / g.spacing[u];
            p[v] = 45 + rho * std::sin(t) / g.spacing[v];
            CHECK(c.solid->level(g.index_to_world(p)) == Approx(rho - r).margin(0.02));
        }
        Vec3 middle;
        middle[axis] = 25;
        middle[u] = 40;
        middle[v] = 45;
        CHECK(widest_gap(*c.solid, all_points(c), g.index_to_world(middle), 30) < step);
        // The slices are one world unit apart and span ten units. The dome at each end is one unit high, and its volume
        // is half of that of a cylinder of this height: 10 + 2 * 1/2.
        CHECK(volume(*c.solid, 0.5) == Approx(kPi * r * r * 11).epsilon(0.01));
    }
}

TEST_CASE("Points between the slices close steep walls, terraces and caps") {
    Drawing drawing(cube(80));
    // A cone of radius 30 to 10, and on it a cylinder of radius 4, so that the last slice of the cone is a terrace.
    for (int k = 10; k <= 20; ++k) drawing.circle(40, 40, k, 30 - 2 * (k - 10));
    for (int k = 21; k <= 30; ++k) drawing.circle(40, 40, k, 4);
    const Contours c = drawing.densify(1);
    CHECK(widest_gap(*c.solid, all_points(c), {40, 40, 14}, 60) < 1);
    const BandReport all = flood(all_points(c), 1, 1.5);
    CHECK_FALSE(all.leaks);
    // The points of the contours alone leak, at least at the caps. The points between the slices close the gaps.
    CHECK(flood(c.along, 1, 1.5).leaks);
}

TEST_CASE("A cone between slices five voxels apart is accurate to 0.02 voxels") {
    const auto radius = [](double k) { return 4 + 0.4 * k; };
    Drawing drawing(cube(80));
    for (int k = 10; k <= 50; k += 5) drawing.circle(40, 40, k, radius(k));
    const Contours c = drawing.densify(1);
    CHECK(c.slice_distance == 5);
    double worst = 0;
    for (double k = 15; k <= 45; k += 0.5)
        for (const double off : {-1.5, -0.5, 0.0, 1.0})
            worst = std::max(worst, std::abs(c.solid->level({40 + radius(k) + off, 40, k}) - off));
    CHECK(worst < 0.02);
}

TEST_CASE("An ellipsoid between slices is closer than by linear interpolation, and its poles are found") {
    const double a = 28, half = 30, gap = 6;
    const auto radius = [&](double w) { return a * std::sqrt(std::max(0.0, 1 - w * w / (half * half))); };
    Drawing drawing(cube(100));
    for (double w = -27; w <= 27; w += gap) drawing.circle(50, 50, 50 + w, radius(w));
    const Contours c = drawing.densify(1);
    double cubic = 0, linear = 0;
    for (double w = -27; w < 27; w += gap)
        for (double t = 0.1; t < 1; t += 0.1) {
            const double r = radius(w + t * gap);
            cubic = std::max(cubic, std::abs(c.solid->level({50 + r, 50, 50 + w + t * gap})));
            linear = std::max(linear, r - ((1 - t) * radius(w) + t * radius(w + gap)));
        }
    CHECK(linear > 0.7);
    CHECK(cubic < 0.5 * linear);
    // The poles lie 3 beyond the first and the last slice. compute_cap_height() finds them, because the area of the
    // ellipsoid's sections is nearly linear in the height there.
    for (const double sign : {-1.0, 1.0}) {
        CHECK(c.solid->level({50, 50, 50 + sign * 29}) < 0);
        CHECK(c.solid->level({50, 50, 50 + sign * 31}) > 0);
    }
    CHECK(volume(*c.solid, 1) == Approx(4 / 3.0 * kPi * a * a * half).epsilon(0.01));
    CHECK_FALSE(flood(all_points(c), 1, 1.5).leaks);
}

TEST_CASE("A hole that the next slice lacks ends between the two slices") {
    Drawing drawing(cube(60));
    for (int k = 10; k <= 20; k += 5) drawing.circle(30, 30, k, 20).circle(30, 30, k, 6);  // a hole
    for (int k = 25; k <= 40; k += 5) drawing.circle(30, 30, k, 20);
    const Contours c = drawing.densify(1);
    CHECK(c.solid->level({30, 30, 20}) > 0);
    CHECK(c.solid->level({30, 30, 25}) < 0);
    double ends = 20;
    while (c.solid->level({30, 30, ends}) > 0) ends += 0.01;
    CHECK((ends > 20.3 && ends < 24));
    CHECK(c.solid->level({30 + 5.5, 30, 20.01}) > 0);
    CHECK(c.solid->level({30 + 5.5, 30, ends}) < 0);
    CHECK_FALSE(flood(all_points(c), 1, 1.5).leaks);
}

TEST_CASE("A single contour that moves by more than its width is followed, several ones end between slices") {
    Drawing drawing(cube(80));
    for (int n = 0; n < 5; ++n) drawing.circle(15 + 12 * n, 40, 10 + 5 * n, 4);
    Warnings warnings;
    const Contours c = drawing.densify(1, ContourCurve::Lines, warnings.run);
    REQUIRE(warnings.lines.size() == 1);
    CHECK(warnings.lines[0].find("do not overlap") != std::string::npos);
    // The body is a sheared cylinder: halfway between two slices its centre is halfway between those of their circles.
    CHECK(c.solid->level({21, 40, 12.5}) == Approx(-4).margin(0.1));
    CHECK(c.solid->level({25, 40, 12.5}) == Approx(0).margin(0.1));
    CHECK(c.solid->level({15, 40, 14.9}) > 0);
    // If a slice has several contours and none overlaps the next slice's, the parts end between the slices.
    Drawing several(cube(80));
    several.circle(10, 20, 10, 5).circle(10, 50, 10, 5).circle(40, 20, 15, 5).circle(40, 50, 15, 5);
    Warnings ended;
    const Contours parts = several.densify(1, ContourCurve::Lines, ended.run);
    REQUIRE(ended.lines.size() == 1);
    CHECK(ended.lines[0].find("several contours and no overlap") != std::string::npos);
    CHECK(parts.solid->level({25, 35, 12.5}) > 0);
}

TEST_CASE("Slices may be unevenly spaced and lie between those of the image") {
    Drawing drawing(cube(60));
    const std::vector<double> at{10, 11.5, 14.25, 20, 21, 30.5};
    for (const double k : at) drawing.circle(30, 30, k, 10);
    const Contours c = drawing.densify(1);
    CHECK(c.slices == at.size());
    for (double k = 10; k < 30.5; k += 0.7) CHECK(c.solid->level({40, 30, k}) == Approx(0).margin(0.02));
    // Contours whose planes differ only by rounding (10 and 10.05) belong to one slice.
    Drawing shaken(cube(60));
    shaken.circle(30, 30, 10, 12).circle(30, 30, 10.05, 6).circle(30, 30, 12, 12);
    const Contours s = shaken.densify(1);
    CHECK(s.slices == 2);
    CHECK(s.solid->level({30, 30, 10}) > 0);
}

// ---- caps -----------------------------------------------------------------------------------------------------------

TEST_CASE("compute_cap_height: the section's area is extrapolated to zero, at most to the next slice") {
    // Areas of sections of an ellipsoid near its pole are linear in the height.
    CHECK(compute_cap_height(3, 9, 4, 4) == Approx(2));
    CHECK(compute_cap_height(3, 4, 4, 4) == 4);  // at most the usual distance between slices
    CHECK(compute_cap_height(3, 3, 4, 4) == 4);
    CHECK(compute_cap_height(5, 3, 4, 4) == 4);
    CHECK(compute_cap_height(3, 0, 4, 4) == 4);
}

// ---- beyond the image's end -----------------------------------------------------------------------------------------

/// Checks that the inside lies in box(), and that may_meet() is true for balls that the surface crosses.
void check_bounds(const ContourSolid& solid, const Vec3& middle, double far) {
    const WorldBox box = solid.box();
    std::mt19937 random(11);
    std::uniform_real_distribution<double> away(-far, far);
    for (int n = 0; n < 20000; ++n) {
        const Vec3 p{middle[0] + away(random), middle[1] + away(random), middle[2] + away(random)};
        bool within = true;
        for (int a = 0; a < 3; ++a) within = within && p[a] >= box.min[a] - 1e-6 && p[a] <= box.max[a] + 1e-6;
        const double level = solid.level(p);
        if (!within) CHECK(level > 0);
        const Vec3 q{p[0] + 3, p[1] + 2, p[2] - 3};
        if ((level < 0) != (solid.level(q) < 0)) CHECK(solid.may_meet(p, distance(p, q)));
    }
}

TEST_CASE("A body cut by the image continues beyond its end and is bounded, also in a rotated image") {
    for (const ImageGeometry& g : {turned_geometry(), cube(80)}) {
        Drawing drawing(g);
        for (int k = 0; k < 12; k += 2) drawing.circle(40, 45, k, 8 - 0.3 * k);
        const Contours c = drawing.densify(0.5);
        const auto level = [&](double x, double k) { return c.solid->level(g.index_to_world({x, 45, k})); };
        CHECK(level(40, -0.4) < -5);
        CHECK(level(40, -3) < 0);   // the wall continues beyond the image by the width of a band
        CHECK(level(40, -40) > 0);  // farther away the body has ended
        CHECK(level(40, -1000) > 0);
        CHECK(c.solid->may_meet(g.index_to_world({40, 45, -1000}), 5) == false);
        check_bounds(*c.solid, g.index_to_world({40, 45, 0}), 60);
    }
}

TEST_CASE("A section that widens towards the image's end widens by at most 45 degrees beyond it") {
    // The radius grows from 2 to 9 over three slices; the image ends 2.5 beyond the second contour.
    const Contours c = Drawing(cube(60)).circle(30, 30, 54, 2).circle(30, 30, 57, 9).densify(1);
    const auto radius_at = [&](double k) {
        double r = 0;
        while (c.solid->level({30 + r, 30, k}) < 0 && r < 1000) r += 0.05;
        return r;
    };
    CHECK(radius_at(57) == Approx(9).margin(0.2));
    CHECK(radius_at(59.4) > 9.5);
    CHECK(radius_at(59.4) < 9 + 2.4 + 0.2);  // the wall slopes outward by at most 45 degrees
    for (double k = 60; k < 80; k += 1) CHECK(radius_at(k) < 9 + (k - 57) + 0.2);
    check_bounds(*c.solid, {30, 30, 57}, 100);
    // A section that becomes narrower towards the image's end continues to do so at the same rate.
    const Contours cone = Drawing(cube(60)).circle(30, 30, 54, 20).circle(30, 30, 57, 14).densify(1);
    for (const double k : {58.0, 59.0})
        CHECK(cone.solid->level({30 + 14 - 2 * (k - 57), 30, k}) == Approx(0).margin(0.1));
}

TEST_CASE("The start from contours in a corner of the image is negative inside and positive far away") {
    // Two contours of a small body in a corner of the image, one of them along the image's end.
    Drawing drawing(cube(60));
    drawing.add({{5, 59, 55}, {1.5, 59, 55}, {0.5, 58, 55}, {4, 57, 55}});
    drawing.add(
        {{8, 59, 58}, {3, 59, 58}, {-0.5, 57.5, 58}, {-0.5, 52, 58}, {1, 49, 58}, {4.5, 51, 58}, {8.5, 54, 58}});
    const Contours c = drawing.densify(1, ContourCurve::Spline);
    REQUIRE(c.solid != nullptr);
    check_bounds(*c.solid, {4, 56, 57}, 60);
    const FloatGridPtr u = start_from_contours(make_domain(cube(60).world_box(), 1), *c.solid);
    const auto accessor = u->getConstAccessor();
    CHECK(accessor.getValue({4, 56, 58}) < 0);
    for (const int x : {20, 59})
        for (const int y : {0, 35})
            for (const int z : {0, 30, 59}) CHECK(accessor.getValue({x, y, z}) > 0);
}

TEST_CASE("One slice makes a lens, and two slices make a closed body") {
    const Contours one = Drawing(cube(60)).circle(30, 30, 20, 10).densify(1);
    CHECK(one.slices == 1);
    CHECK(one.slice_distance == 1);
    // The lens is two paraboloids of height 1, each with half the volume of a cylinder of this height.
    CHECK(volume(*one.solid, 0.2) == Approx(kPi * 100).epsilon(0.03));
    CHECK(widest_gap(*one.solid, all_points(one), {30, 30, 20}, 30) < 1);
    const Contours two = Drawing(cube(60)).circle(30, 30, 20, 10).circle(30, 30, 24, 10).densify(1);
    CHECK(two.slices == 2);
    CHECK(volume(*two.solid, 0.4) == Approx(kPi * 100 * 8).epsilon(0.02));
    CHECK_FALSE(flood(all_points(two), 1, 1.5).leaks);
}

// ---- the body as a start --------------------------------------------------------------------------------------------

TEST_CASE("may_meet is true for every ball that the surface crosses") {
    Drawing drawing(turned_geometry());
    for (int k = 15; k <= 45; k += 5) drawing.circle(38 + 0.3 * k, 45, k, 6 + 0.1 * k);
    drawing.circle(38 + 0.3 * 25, 45, 25, 3);
    const Contours c = drawing.densify(0.5);
    const WorldBox box = c.solid->box();
    std::mt19937 random(11);
    std::uniform_real_distribution<double> unit(-0.1, 1.1), size(0.2, 4);
    int crossed = 0, denied = 0;
    for (int n = 0; n < 4000; ++n) {
        Vec3 p;
        for (int a = 0; a < 3; ++a) p[a] = box.min[a] + unit(random) * (box.max[a] - box.min[a]);
        const double r = size(random);
        const bool met = c.solid->may_meet(p, r);
        bool inside = false, outside = false;
        for (int probe = 0; probe < 30; ++probe) {
            Vec3 q = p;
            for (int a = 0; a < 3; ++a) q[a] += (2 * (unit(random) + 0.1) / 1.2 - 1) * r / std::sqrt(3.0);
            (c.solid->level(q) < 0 ? inside : outside) = true;
        }
        if (inside && outside) {
            ++crossed;
            CHECK(met);
        }
        denied += !met;
    }
    CHECK(crossed > 200);
    CHECK(denied > 500);
}

TEST_CASE("The start from contours has the volume of their body, and holes stay open") {
    Drawing drawing(cube(64, 0.5));
    for (int k = 12; k <= 50; k += 2) drawing.circle(32, 32, k, 12).circle(32, 32, k, 5);
    const Contours c = drawing.densify(0.5);
    const Domain domain = make_domain(drawing.geometry().world_box(), 0.5);
    const FloatGridPtr u = start_from_contours(domain, *c.solid);
    CHECK(domain_of(*u) == domain);
    double inside = 0;
    for (int i = domain.min[0]; i <= domain.max[0]; ++i)
        for (int j = domain.min[1]; j <= domain.max[1]; ++j)
            for (int k = domain.min[2]; k <= domain.max[2]; ++k) {
                const openvdb::Coord at(i, j, k);
                const bool in = u->tree().getValue(at) < 0;
                inside += in;
                const double level = c.solid->level(domain.index_to_world({double(i), double(j), double(k)}));
                if (std::abs(level) > 1e-4) CHECK(in == (level < 0));
            }
    CHECK(inside * 0.125 == Approx(kPi * (144 - 25) * 20).epsilon(0.02));
}

TEST_CASE("densify: the points do not depend on the number of threads") {
    Drawing drawing(turned_geometry());
    for (int k = 10; k <= 50; k += 5) drawing.circle(38, 45, k, 5 + 0.1 * k).circle(38, 45, k, 2);
    RunContext run;
    run.threads = 1;
    const Contours one = drawing.densify(0.5, ContourCurve::Spline, run);
    for (const int threads : {2, 8}) {
        run.threads = threads;
        const Contours more = drawing.densify(0.5, ContourCurve::Spline, run);
        CHECK(one.along == more.along);
        CHECK(one.between == more.between);
    }
}
