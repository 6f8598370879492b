// Clouds that enclose nothing: scans from some sides only.
#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "covol/cloud_surface.h"
#include "covol/error.h"
#include "covol/evidence.h"
#include "covol/pipeline.h"
#include "covol/surface.h"
#include "support/clouds.h"

using namespace covol;

namespace {

const double kPi = std::acos(-1.0);

// The lower half of a sphere of radius 1: a bowl.
std::vector<Vec3> bowl(int count, unsigned seed) {
    std::vector<Vec3> points;
    for (const Vec3& p : test::sphere_cloud(2 * count, 1, seed))
        if (p[2] < 0) points.push_back(p);
    return points;
}

// A torus whose tube (radius 0.35 around a circle of radius 1) was scanned from outside on one half and from inside on
// the other half: it encloses nothing.
std::vector<Vec3> half_seen_torus(int count, double noise, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> angle(-kPi, kPi);
    std::normal_distribution<double> off(0, noise);
    std::vector<Vec3> points;
    while (int(points.size()) < count) {
        const double around = angle(random), tube = angle(random);
        const bool faces_out = std::abs(tube)<0.62 * kPi, faces_in = std::abs(tube)> 0.38 * kPi;
        if (around > 0 ? !faces_out : !faces_in) continue;
        const double r = 0.35 + off(random), away = 1 + r * std::cos(tube);
        points.push_back({away * std::cos(around), away * std::sin(around), r * std::sin(tube)});
    }
    return points;
}

double distance_to_torus(const Vec3& p) { return std::abs(std::hypot(std::hypot(p[0], p[1]) - 1, p[2]) - 0.35); }

}  // namespace

TEST_CASE("surface_from_cloud: a bowl becomes a closed solid with a lid, not a thin shell") {
    for (unsigned seed = 1; seed <= 3; ++seed) {
        const CloudOrientation cloud = orient_cloud(bowl(4000, seed));
        const TriangleMesh mesh =
            extract_mesh(*surface_from_cloud(make_domain({{-1.5, -1.5, -1.5}, {1.5, 1.5, 1.5}}, 0.05), cloud).u);
        const MeshMeasures m = measure(mesh);
        CHECK(m.closed);
        CHECK(m.components == 1);
        CHECK(m.genus == 0);
        // The surface closes the bowl with a lid. Its volume is that of half a ball, within 40 %, because the lid may
        // sag or bulge.
        CHECK(m.volume < 2.0 / 3 * kPi * 1.4);
        CHECK(m.volume > 2.0 / 3 * kPi * 0.6);
        // A flat lid would have a third of the whole area. The part of the lid near the rim is close to the points, so
        // that it does not count as without points.
        const double fraction = measure_fraction_without_points(mesh, cloud.points, 0.15);
        CHECK(fraction > 0.15);
        CHECK(fraction < 0.45);
        CHECK(measure_fraction_without_points(mesh, cloud.points, 3.0) == 0);
    }
}

TEST_CASE("reconstruct: points in a plane are rejected") {
    std::vector<Vec3> plane;
    for (int i = 0; i < 80; ++i)
        for (int j = 0; j < 80; ++j) plane.push_back({0.1 * i, 0.1 * j, 0});
    CHECK_THROWS_AS(reconstruct(plane, {}), Error);
}

TEST_CASE("reconstruct: a bowl is closed by a lid, and the surface passes the points elsewhere") {
    const std::vector<Vec3> points = bowl(6000, 2);
    SegmentOptions options;
    options.voxel_size = 0.04;
    const SegmentResult result = reconstruct(points, options);
    CHECK(result.report.automatic.count("start") == 1);
    CHECK(result.report.surface.closed);
    CHECK(result.report.surface.genus == 0);
    CHECK(result.report.surface.components == 1);
    CHECK(result.report.fit.mean < 0.5 * 0.04);
    CHECK(result.report.fraction_without_points > 0.1);
}

TEST_CASE("reconstruct: a noisy torus with halves scanned only from outside or inside has genus 1") {
    const std::vector<Vec3> points = half_seen_torus(12000, 0.01, 3);
    SegmentOptions options;
    options.voxel_size = 0.05;
    const SegmentResult result = reconstruct(points, options);
    CHECK(result.report.surface.closed);
    CHECK(result.report.surface.components == 1);
    CHECK(result.report.surface.genus == 1);
    CHECK(result.report.fit.mean < 0.5 * 0.05);
    // Near the points, the surface must agree with the torus.
    double sum = 0, count = 0;
    for (const auto& v : result.mesh.vertices) {
        const Vec3 p{v[0], v[1], v[2]};
        if (test::brute_force_distance(points, p) > 0.05) continue;
        sum += distance_to_torus(p);
        ++count;
    }
    CHECK(sum / count < 0.5 * 0.05);
}
