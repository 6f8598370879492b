#include "cloud/orientation/layers.h"

#include <algorithm>
#include <catch2/catch.hpp>

#include "cloud/indicator/areas.h"
#include "cloud/indicator/indicator.h"
#include "cloud/orientation/heuristics.h"
#include "support/clouds.h"
#include "support/surface_samples.h"

using namespace covol;
using namespace covol::cloud;

namespace {

/// Points of an upper and a lower layer, and the directions from which they were seen. The lower layer was seen only
/// from inside the scan, through its opening.
struct Layers {
    std::vector<Vec3> points, free;
    std::vector<char> is_lower;
    Orientation orientation;

    void add(const Vec3& p, const Vec3& sees, bool lower) {
        points.push_back(p);
        free.push_back(test::scaled(lower ? 0.03 : 0.2, sees));
        is_lower.push_back(lower);
        orientation.normals.push_back(sees);
    }
    std::vector<char> turn(double spacing) {
        orientation.areas = areas_of(points, spacing);
        WindingField field(
            indicator_grid(points, {}, longest_side(bounding_box(points)) * (1 + 2 * kCommon.margin) / 80));
        solve(field, points, orientation, kCyclesFromNothing, {});
        const double half = scale_to_half(field, points);
        for (double& area : orientation.areas) area *= half;
        const std::vector<char> turned = turn_layers(field, points, free, spacing, orientation, {});
        inside = field.indicator().value_at({0.6, 0, 0});
        return turned;
    }
    double inside = 0;
};

constexpr int kCount = 16000;
const double kSpacing = std::sqrt(4 * M_PI / kCount), kDepth = 1 - 4 * kSpacing;

}  // namespace

TEST_CASE("turn_layers: a second layer below the surface is turned outwards and makes no cavity") {
    for (const unsigned seed : {1, 2, 3}) {
        // A sphere that is open at the top. A part of it was scanned twice, and the points of the second scan lie too
        // deep.
        Layers scan;
        for (const Vec3& p : test::sphere_cloud(kCount, 1, seed)) {
            if (p[2] > 0.75) continue;
            scan.add(p, p, false);
            if (p[0] > 0.6) scan.add(test::scaled(kDepth, p), test::scaled(-1, p), true);
        }
        const std::vector<char> turned = scan.turn(kSpacing);
        std::size_t lower = 0, upper = 0;
        for (std::size_t n = 0; n < turned.size(); ++n) (scan.is_lower[n] ? lower : upper) += std::size_t(turned[n]);
        CHECK(double(lower) > 0.9 * double(std::count(scan.is_lower.begin(), scan.is_lower.end(), 1)));
        CHECK(upper == 0);
        CHECK(scan.inside > 0.8);
    }
}

TEST_CASE("turn_layers: the inner wall of a cup is not turned, and the cup stays hollow") {
    for (const unsigned seed : {1, 2, 3}) {
        Layers cup;
        for (const Vec3& p : test::sphere_cloud(kCount, 1, seed)) {
            if (p[2] > 0.3) continue;
            cup.add(p, p, false);
            cup.add(test::scaled(kDepth, p), test::scaled(-1, p), true);
        }
        const std::vector<char> turned = cup.turn(kSpacing);
        CHECK(std::count(turned.begin(), turned.end(), 1) == 0);
        CHECK(cup.inside < 0.2);
    }
}
