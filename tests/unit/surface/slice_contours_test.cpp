#include "covol/slice_contours.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "surface/keyholes.h"

using namespace covol;

namespace {

/// A lattice that is rotated about two axes and has pixels that are not square.
ImageGeometry turned_lattice() {
    ImageGeometry g;
    g.size = {50, 44, 20};
    g.spacing = {0.5, 0.7, 1.4};
    const double a = 0.4, b = -0.7;
    g.direction = {{{std::cos(b), -std::sin(b), 0},
                    {std::cos(a) * std::sin(b), std::cos(a) * std::cos(b), -std::sin(a)},
                    {std::sin(a) * std::sin(b), std::sin(a) * std::cos(b), std::cos(a)}}};
    g.origin = {-100, 40, 7};
    return g;
}

FloatGridPtr ball(double radius, const Vec3& center, double voxel) {
    const openvdb::Vec3f at{float(center[0]), float(center[1]), float(center[2])};
    return openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(float(radius), at, float(voxel));
}

double distance(const Vec3& a, const Vec3& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

double area(const std::vector<detail::PlanePoint>& curve) {
    double twice = 0;
    for (std::size_t n = 0; n < curve.size(); ++n) {
        const auto &a = curve[n], &b = curve[(n + 1) % curve.size()];
        twice += a[0] * b[1] - b[0] * a[1];
    }
    return twice / 2;
}

std::vector<detail::PlanePoint> in_pixels(const SliceContour& contour, const ImageGeometry& g) {
    std::vector<detail::PlanePoint> curve;
    for (const Vec3& point : contour.points) {
        const Vec3 voxel = g.world_to_index(point);
        curve.push_back({voxel[0], voxel[1]});
    }
    return curve;
}

}  // namespace

TEST_CASE("Contours of a ball lie on its surface, in each slice that it meets, for two voxel sizes") {
    openvdb::initialize();
    const ImageGeometry g = turned_lattice();
    const Vec3 center = g.index_to_world({24.3, 21.8, 9.4});
    constexpr double kRadius = 9;
    for (const double voxel : {0.2, 0.5}) {
        const std::vector<SliceContour> contours = outline_slices(*ball(kRadius, center, voxel), g);
        CHECK(contours.size() == 13);  // slices 9.4 - 9 / 1.4 to 9.4 + 9 / 1.4: 3 to 15
        for (const SliceContour& contour : contours) {
            CHECK(contour.slice >= 3);
            CHECK(contour.slice <= 15);
            for (const Vec3& point : contour.points) {
                CHECK(g.world_to_index(point)[2] == Approx(contour.slice).margin(1e-9));
                CHECK(distance(point, center) == Approx(kRadius).margin(0.02 * 0.5));
            }
            const double off = (contour.slice - 9.4) * 1.4, square = kRadius * kRadius - off * off;
            // Chords of length c cut off an area of about pi c^2 / 6, independent of the radius.
            CHECK(area(in_pixels(contour, g)) * 0.5 * 0.7 == Approx(M_PI * square).epsilon(0.005).margin(0.5));
        }
    }
}

TEST_CASE("Contours end half a voxel beyond the image's last voxel centres") {
    openvdb::initialize();
    const ImageGeometry g = turned_lattice();
    for (const double voxel : {0.5, 0.3, 0.24}) {  // one, two and three samples per pixel
        const std::vector<SliceContour> contours = outline_slices(*ball(26, g.index_to_world({25, 22, 10}), voxel), g);
        REQUIRE(contours.size() == 20);
        for (const SliceContour& contour : contours)
            CHECK(area(in_pixels(contour, g)) == Approx(50 * 44).epsilon(1e-3));
    }
}

TEST_CASE("A surface that no slice meets has no contours") {
    openvdb::initialize();
    const ImageGeometry g = turned_lattice();
    CHECK(outline_slices(*ball(1, g.index_to_world({20, 20, -9}), 0.2), g).empty());
    CHECK(outline_slices(*std::make_shared<openvdb::FloatGrid>(1.0F), g).empty());
}

TEST_CASE("A part with holes becomes one curve around the remaining area, with a channel to each hole") {
    using Curve = std::vector<detail::PlanePoint>;
    const auto square = [](double x, double y, double half, bool is_hole) {
        Curve curve{{x - half, y - half}, {x + half, y - half}, {x + half, y + half}, {x - half, y + half}};
        if (is_hole) std::reverse(curve.begin(), curve.end());
        return curve;
    };
    // A part with two holes, another part within one of the holes, and a separate part.
    const std::vector<Curve> joined =
        detail::join_holes({square(0, 0, 10, false), square(-5, 0, 3, true), square(5, 0, 2, true),
                            square(-5, 0, 1, false), square(40, 0, 2, false)});
    REQUIRE(joined.size() == 3);
    CHECK(joined[0].size() == 4 + 2 * (4 + 2));
    CHECK(area(joined[0]) == Approx(400 - 36 - 16));
    CHECK(area(joined[1]) == Approx(4));
    CHECK(area(joined[2]) == Approx(16));
}
