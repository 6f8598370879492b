#include "covol/contours.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "contours/contour_curve.h"
#include "contours/slice_field.h"
#include "covol/band.h"
#include "covol/distance.h"
#include "covol/error.h"
#include "covol/start.h"
#include "support/scratch.h"

using namespace covol;

namespace {

const double kPi = std::acos(-1.0);

/// Builds lines of marks whose coordinates are voxel indices of one image.
class Drawing {
public:
    explicit Drawing(ImageGeometry geometry) : geometry_(std::move(geometry)) {
        cloud_.space = PointSpace::Index;
        cloud_.source = "marks.csv";
    }

    Drawing& add(const std::vector<Vec3>& marks, bool closed = true) {
        MarkLine line;
        line.begin = cloud_.points.size();
        cloud_.points.insert(cloud_.points.end(), marks.begin(), marks.end());
        line.end = cloud_.points.size();
        line.closed = closed;
        cloud_.lines.push_back(line);
        return *this;
    }
    /// A circle of world radius r around the voxel position (x, y) in slice k; `axis` is the normal of the slices.
    Drawing& circle(double x, double y, double k, double r, int axis = 2, int count = 96) {
        const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
        std::vector<Vec3> marks;
        for (int n = 0; n < count; ++n) {
            Vec3 p;
            p[axis] = k;
            p[u] = x + r * std::cos(2 * kPi * n / count) / geometry_.spacing[u];
            p[v] = y + r * std::sin(2 * kPi * n / count) / geometry_.spacing[v];
            marks.push_back(p);
        }
        return add(marks);
    }
    Drawing& loose(const Vec3& mark) {
        cloud_.points.push_back(mark);
        return *this;
    }

    [[nodiscard]] Contours densify(double step, ContourCurve curve = ContourCurve::Lines,
                                   const RunContext& run = {}) const {
        return covol::densify({cloud_}, geometry_, {step, curve}, run);
    }
    [[nodiscard]] const ImageGeometry& geometry() const { return geometry_; }
    [[nodiscard]] const PointCloud& cloud() const { return cloud_; }

private:
    ImageGeometry geometry_;
    PointCloud cloud_;
};

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

ImageGeometry cube(int size, double spacing = 1) {
    ImageGeometry g;
    g.size = {size, size, size};
    g.spacing = {spacing, spacing, spacing};
    return g;
}

double distance(const Vec3& a, const Vec3& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

double nearest(const Vec3& from, const std::vector<Vec3>& points) {
    double best = std::numeric_limits<double>::max();
    for (const Vec3& p : points) best = std::min(best, distance(from, p));
    return best;
}

std::vector<Vec3> all_points(const Contours& c) {
    std::vector<Vec3> points = c.along;
    points.insert(points.end(), c.between.begin(), c.between.end());
    return points;
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

/// The report of tag_interior(): a flood fill from outside through {d > D}, with a test for leaks.
BandReport flood(const std::vector<Vec3>& points, double h, double D) {
    const Domain domain = make_domain(bounding_box(points, D + 6 * h), h);
    const FloatGridPtr d = covol::compute_distance(points, domain, {D + 6 * h}).grid;
    return tag_interior(*d, {D, {}}).report;
}

struct Warnings {
    std::vector<std::string> lines;
    RunContext run;
    Warnings() {
        run.log = [this](LogLevel level, const std::string& line) {
            if (level == LogLevel::Warning) lines.push_back(line);
        };
    }
};

}  // namespace

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
    CHECK(warnings.lines[0].find("5 contours are repeated") != std::string::npos);
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
