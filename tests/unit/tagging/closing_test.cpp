#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "covol/band.h"
#include "covol/distance.h"
#include "covol/surface.h"

using namespace covol;

namespace {

// Points on a sphere of radius 1, spread evenly (Fibonacci lattice), about 3.5/sqrt(n) apart.
std::vector<Vec3> sphere_points(int n) {
    std::vector<Vec3> points;
    for (int i = 0; i < n; ++i) {
        const double z = 1.0 - (2.0 * i + 1.0) / n, r = std::sqrt(1.0 - z * z), a = 2.39996322972865332 * i;
        points.push_back({r * std::cos(a), r * std::sin(a), z});
    }
    return points;
}

}  // namespace

TEST_CASE("The closing of the tagged points of a sphere touches the points and stays near the sphere") {
    const double h = 0.05, D = 0.45;
    const std::vector<Vec3> points = sphere_points(120);
    const Domain domain = make_domain({{-2, -2, -2}, {2, 2, 2}}, h);
    const FloatGridPtr d = compute_distance(points, domain, {D + 5 * h}).grid;
    const BandResult tagged = tag_interior(*d, {D, {}});
    REQUIRE_FALSE(tagged.report.leaks);

    const FloatGridPtr closed = close_by_ball(*tagged.grid, D);
    REQUIRE(closed);
    const FloatGridPtr solid = extract_surface(*closed);
    const TriangleMesh mesh = extract_mesh(*solid);
    CHECK(measure(mesh).genus == 0);
    CHECK(measure(mesh).closed);
    // The closing has a cusp at each point, which the grid rounds by less than a voxel.
    const FitStatistics fit = measure_fit(points, mesh);
    CHECK(fit.max < h);
    CHECK(fit.mean < 0.5 * h);
    // Between the points that it touches, the closing ball of radius D dips inward by at most its sagitta, D - sqrt(D^2
    // - gap^2), where gap is half of the distance between these points.
    const double gap = 0.5 * 3.545 / std::sqrt(120.0) * std::sqrt(2.0), dip = D - std::sqrt(D * D - gap * gap);
    for (const auto& v : mesh.vertices) {
        const double r = std::hypot(v[0], v[1], v[2]);
        REQUIRE(r < 1.0 + 0.5 * h);
        REQUIRE(r > 1.0 - dip - gap * gap / 2 - h);
    }
}

TEST_CASE("close_by_ball returns no grid if the ball is larger than the body") {
    const double h = 0.05;
    const Domain domain = make_domain({{-2, -2, -2}, {2, 2, 2}}, h);
    // A single point: the tagged body is the ball of radius D around it, and its closing is the point itself.
    const FloatGridPtr d = compute_distance({{0.01, 0.02, 0.015}}, domain, {0.5 + 5 * h}).grid;
    const BandResult tagged = tag_interior(*d, {0.5, {}});
    const FloatGridPtr closed = close_by_ball(*tagged.grid, 0.5 + h);
    CHECK_FALSE(closed);
}
