#include "covol/holes.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "covol/error.h"
#include "covol/pipeline.h"
#include "covol/surface.h"
#include "holes/cut.h"
#include "holes/membrane.h"
#include "support/clouds.h"

using namespace covol;

namespace {

const double kPi = std::acos(-1.0);

/// The unit sphere: an octahedron whose triangles are subdivided, with the vertices projected onto the sphere.
TriangleMesh sphere_mesh(int subdivisions) {
    TriangleMesh mesh{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                      {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
    for (int n = 0; n < subdivisions; ++n) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [at, is_new] = middles.try_emplace(std::minmax(a, b), std::uint32_t(mesh.vertices.size()));
            if (is_new) {
                std::array<float, 3> m{};
                float square = 0;
                for (int c = 0; c < 3; ++c) {
                    m[c] = mesh.vertices[a][c] + mesh.vertices[b][c];
                    square += m[c] * m[c];
                }
                for (float& c : m) c /= std::sqrt(square);
                mesh.vertices.push_back(m);
            }
            return at->second;
        };
        std::vector<std::array<std::uint32_t, 3>> finer;
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::uint32_t x = middle(a, b), y = middle(b, c), z = middle(c, a);
            finer.insert(finer.end(), {{a, x, z}, {x, b, y}, {z, y, c}, {x, y, z}});
        }
        mesh.triangles = finer;
    }
    return mesh;
}

double narrowest_angle(const TriangleMesh& mesh) {
    double minimum = kPi;
    for (const auto& t : mesh.triangles)
        for (int k = 0; k < 3; ++k) {
            std::array<double, 3> u{}, v{};
            double uu = 0, vv = 0, uv = 0;
            for (int c = 0; c < 3; ++c) {
                u[c] = double(mesh.vertices[t[(k + 1) % 3]][c]) - mesh.vertices[t[k]][c];
                v[c] = double(mesh.vertices[t[(k + 2) % 3]][c]) - mesh.vertices[t[k]][c];
                uu += u[c] * u[c];
                vv += v[c] * v[c];
                uv += u[c] * v[c];
            }
            minimum = std::min(minimum, std::acos(std::clamp(uv / std::sqrt(uu * vv), -1.0, 1.0)));
        }
    return minimum * 180 / kPi;
}

/// Random points of the unit sphere, of which those are kept for which keep(point) is true.
template <typename Keep>
std::vector<Vec3> sphere_points(int count, unsigned seed, Keep keep) {
    std::vector<Vec3> points;
    for (const Vec3& p : test::sphere_cloud(count, 1, seed))
        if (keep(p)) points.push_back(p);
    return points;
}

template <typename Function>
TreatedHoles treat(Function function, const TriangleMesh& mesh, const std::vector<Vec3>& points,
                   double slack_fraction = 1.0 / 6) {
    const double distance = choose_hole_distance(points, 0.01);
    return function(mesh, measure_distances(mesh, points), distance, slack_fraction * distance, RunContext{});
}

}  // namespace

TEST_CASE("Boundary loops: a strip with a hole has two, with their lengths, and a closed mesh has none") {
    // A strip of 4 x 3 unit squares without the square at (1,1).
    TriangleMesh strip;
    for (int j = 0; j <= 3; ++j)
        for (int i = 0; i <= 4; ++i) strip.vertices.push_back({float(i), float(j), 0});
    for (std::uint32_t j = 0; j < 3; ++j)
        for (std::uint32_t i = 0; i < 4; ++i) {
            if (i == 1 && j == 1) continue;
            const std::uint32_t a = 5 * j + i;
            strip.triangles.push_back({a, a + 1, a + 6});
            strip.triangles.push_back({a, a + 6, a + 5});
        }
    const std::vector<BoundaryLoop> loops = find_boundary_loops(strip);
    REQUIRE(loops.size() == 2);
    CHECK(loops[0].edges == 14);
    CHECK(loops[0].length == Approx(14));
    CHECK(loops[1].edges == 4);
    CHECK(loops[1].length == Approx(4));
    CHECK(find_boundary_loops(sphere_mesh(2)).empty());
}

TEST_CASE("Cutting a sphere along a plane: the kept cap has its area and rim, and all angles exceed 8 degrees") {
    const TriangleMesh sphere = sphere_mesh(5);
    const double area = measure(sphere).area;
    for (const double level : {-0.61, 0.0, 0.123, 0.5, 0.97}) {
        std::vector<float> values;
        for (const auto& v : sphere.vertices) values.push_back(float(v[2] * 0.8 + v[0] * 0.6 - level));
        const holes::CutMesh cut = holes::cut_along(sphere, values);
        CHECK(measure(cut.mesh).area == Approx(area).epsilon(1e-3));
        CHECK(measure(cut.mesh).closed);
        CHECK(measure(cut.mesh).manifold);
        const TriangleMesh part = holes::kept_part(cut);
        CHECK(measure(part).area == Approx(2 * kPi * (1 - level)).margin(0.004 * area));
        CHECK(measure(part).manifold);
        CHECK(narrowest_angle(part) > 8);
        const std::vector<BoundaryLoop> loops = find_boundary_loops(part);
        REQUIRE(loops.size() == 1);
        CHECK(loops[0].length == Approx(2 * kPi * std::sqrt(1 - level * level)).epsilon(0.01));
        for (const auto& v : part.vertices) CHECK(v[2] * 0.8 + v[0] * 0.6 > level - 0.002);
    }
}

TEST_CASE("A vertex at which two triangle fans meet is duplicated, so that the part is manifold") {
    // A square of four triangles around a centre. Only two opposite triangles are kept, which meet in the centre alone.
    const TriangleMesh square{{{0, 0, 0}, {1, 1, 0}, {-1, 1, 0}, {-1, -1, 0}, {1, -1, 0}},
                              {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}}};
    const TriangleMesh part = holes::kept_part({square, {1, 0, 1, 0}});
    CHECK(part.triangles.size() == 2);
    CHECK(part.vertices.size() == 6);
    CHECK(measure(part).manifold);
    CHECK(measure(part).components == 2);
    CHECK(find_boundary_loops(part).size() == 2);
}

TEST_CASE("The membrane between two rings is a catenoid, and the membrane over a planar rim is planar") {
    // Two rings of radius cosh(0.5) at z = -0.5 and 0.5. The minimal surface between them is the catenoid r = cosh z.
    constexpr int kAround = 96, kAlong = 40;
    TriangleMesh tube;
    std::vector<char> fixed;
    for (int j = 0; j <= kAlong; ++j)
        for (int i = 0; i < kAround; ++i) {
            const double a = 2 * kPi * i / kAround, r = std::cosh(0.5);
            tube.vertices.push_back({float(r * std::cos(a)), float(r * std::sin(a)), float(double(j) / kAlong - 0.5)});
            fixed.push_back(j == 0 || j == kAlong);
        }
    for (std::uint32_t j = 0; j < kAlong; ++j)
        for (std::uint32_t i = 0; i < kAround; ++i) {
            const std::uint32_t a = j * kAround + i, b = j * kAround + (i + 1) % kAround;
            tube.triangles.push_back({a, b, b + kAround});
            tube.triangles.push_back({a, b + kAround, a + kAround});
        }
    holes::span_membrane(tube, fixed, {});
    double worst = 0;
    for (const auto& v : tube.vertices)
        worst = std::max(worst, std::abs(double(std::hypot(v[0], v[1])) / std::cosh(double(v[2])) - 1));
    CHECK(worst < 0.004);
    CHECK(measure(tube).area == Approx(kPi * (1 + std::sinh(1.0))).epsilon(0.004));

    TriangleMesh sphere = sphere_mesh(4);
    std::vector<char> below;
    for (const auto& v : sphere.vertices) below.push_back(v[2] <= 1e-6F);
    holes::span_membrane(sphere, below, {});
    for (std::size_t v = 0; v < below.size(); ++v)
        if (!below[v]) CHECK(std::abs(sphere.vertices[v][2]) < 1e-4);
    CHECK(measure(sphere).area == Approx(3 * kPi).epsilon(0.01));
    CHECK(measure(sphere).volume == Approx(2 * kPi / 3).epsilon(0.01));
}

TEST_CASE("A partly sampled sphere is trimmed, or closed by a flat lid, at the border of its points") {
    const TriangleMesh sphere = sphere_mesh(6);
    for (unsigned seed = 1; seed <= 5; ++seed)
        for (const double level : {0.0, 0.5, 0.85}) {
            // There are points only below z = level, so that a hole with a rim of radius sqrt(1 - level^2) remains
            // above.
            const std::vector<Vec3> points = sphere_points(8000, seed, [&](const Vec3& p) { return p[2] < level; });
            const double spacing = std::sqrt(4 * kPi / 8000), rim = 2 * kPi * std::sqrt(1 - level * level);
            const TreatedHoles open = treat(trim_holes, sphere, points);
            INFO("seed " << seed << ", hole above z = " << level);
            REQUIRE(open.report.loops.size() == 1);
            CHECK(open.report.loops[0].length == Approx(rim).epsilon(0.06));
            const MeshMeasures m = measure(open.mesh);
            CHECK(m.manifold);
            CHECK_FALSE(m.closed);
            CHECK(m.components == 1);
            CHECK(m.area == Approx(2 * kPi * (1 + level)).margin(rim * spacing));
            CHECK(open.report.fraction == Approx((1 - level) / 2).margin(rim * spacing / (4 * kPi)));
            CHECK(narrowest_angle(open.mesh) > 5);
            // Outward means away from the centre.
            std::size_t inward = 0;
            for (const auto& t : open.mesh.triangles) {
                double up = 0;
                const auto& a = open.mesh.vertices[t[0]];
                const auto& b = open.mesh.vertices[t[1]];
                const auto& c = open.mesh.vertices[t[2]];
                for (int k = 0; k < 3; ++k)
                    up +=
                        a[k] * ((double(b[(k + 1) % 3]) - a[(k + 1) % 3]) * (double(c[(k + 2) % 3]) - a[(k + 2) % 3]) -
                                (double(b[(k + 2) % 3]) - a[(k + 2) % 3]) * (double(c[(k + 1) % 3]) - a[(k + 1) % 3]));
                inward += !(up > 0);
            }
            CHECK(inward == 0);

            const TreatedHoles flat = treat(flatten_holes, sphere, points);
            const double cap = kPi * (1 - level * level), below = kPi * (2.0 / 3 + level - level * level * level / 3);
            CHECK(measure(flat.mesh).closed);
            CHECK(measure(flat.mesh).area == Approx(2 * kPi * (1 + level) + cap).margin(rim * spacing));
            CHECK(measure(flat.mesh).volume == Approx(below).margin(1.5 * cap * spacing));
            CHECK(flat.report.loops.size() == 1);
        }
}

TEST_CASE("Two holes are trimmed, a complete sphere is unchanged, bare surfaces and invalid input are rejected") {
    const TriangleMesh sphere = sphere_mesh(5);
    const std::vector<Vec3> belt = sphere_points(8000, 3, [](const Vec3& p) { return std::abs(p[2]) < 0.6; });
    const TreatedHoles open = treat(trim_holes, sphere, belt);
    REQUIRE(open.report.loops.size() == 2);
    for (const BoundaryLoop& loop : open.report.loops) CHECK(loop.length == Approx(2 * kPi * 0.8).epsilon(0.06));
    CHECK(measure(treat(flatten_holes, sphere, belt).mesh).volume == Approx(2 * kPi * (0.6 - 0.072)).epsilon(0.05));

    const std::vector<Vec3> all = sphere_points(8000, 4, [](const Vec3&) { return true; });
    const TreatedHoles whole = treat(trim_holes, sphere, all);
    CHECK(whole.report.loops.empty());
    CHECK(whole.report.fraction == 0);
    CHECK(whole.mesh.triangles == sphere.triangles);
    CHECK(measure_fraction_beyond(sphere, measure_distances(sphere, all), whole.report.distance) == 0);

    const std::vector<Vec3> far{{5, 0, 0}};
    CHECK_THROWS_AS(trim_holes(sphere, measure_distances(sphere, far), 0.1, 0.01), Error);
    CHECK_THROWS_AS(flatten_holes(sphere, measure_distances(sphere, far), 0.1, 0.01), Error);
    CHECK_THROWS_AS(trim_holes(sphere, {}, 0.1, 0.01), Error);
    CHECK_THROWS_AS(trim_holes(sphere, measure_distances(sphere, all), 0.1, 0.1), Error);
}

TEST_CASE("An isolated point in a hole does not keep a piece of the surface") {
    const TriangleMesh sphere = sphere_mesh(5);
    std::vector<Vec3> points = sphere_points(8000, 5, [](const Vec3& p) { return p[2] < 0; });
    points.push_back({0, 0, 1});
    const TreatedHoles open = treat(trim_holes, sphere, points);
    CHECK(open.report.dropped_pieces <= 1);
    CHECK(open.report.loops.size() == 1);
    CHECK(measure(open.mesh).components == 1);
}

TEST_CASE("Distances to points equal brute force, and the fraction beyond a distance is that outside of a cap") {
    const TriangleMesh sphere = sphere_mesh(4);
    const std::vector<Vec3> points = test::sphere_cloud(200, 1.1, 6);
    const std::vector<float> distances = measure_distances(sphere, points);
    for (std::size_t v = 0; v < distances.size(); v += 37) {
        const auto& p = sphere.vertices[v];
        CHECK(distances[v] == Approx(test::brute_force_distance(points, {p[0], p[1], p[2]})).epsilon(1e-5));
    }
    // The positions within a chord d of the pole form a cap of height d^2 / 2, which for d = 1 is a quarter of the
    // sphere.
    const std::vector<float> from_pole = measure_distances(sphere, {{0, 0, 1}});
    CHECK(measure_fraction_beyond(sphere, from_pole, 1) == Approx(0.75).epsilon(0.02));
}

TEST_CASE("segment: a hemisphere is closed, left open (with a closed level set) or given a flat lid") {
    std::vector<Vec3> points = sphere_points(12000, 7, [](const Vec3& p) { return p[2] < 0; });
    SegmentOptions options;
    options.voxel_size = 0.04;
    const SegmentResult closed = reconstruct(points, options);
    CHECK(closed.report.holes.policy == Holes::Close);
    CHECK(closed.report.holes.loops.empty());
    CHECK(closed.report.fraction_without_points > 0.2);
    CHECK(closed.distance_to_points.size() == closed.mesh.vertices.size());

    options.holes.policy = Holes::Open;
    const SegmentResult open = reconstruct(points, options);
    CHECK_FALSE(open.report.surface.closed);
    CHECK(open.report.surface.manifold);
    REQUIRE(open.report.holes.loops.size() == 1);
    CHECK(open.report.holes.loops[0].length == Approx(2 * kPi).epsilon(0.12));
    CHECK(open.report.surface.area == Approx(2 * kPi).epsilon(0.04));
    CHECK(open.report.surface.volume == Approx(closed.report.surface.volume));
    CHECK(measure(extract_mesh(*open.surface)).closed);
    CHECK(open.distance_to_points.size() == open.mesh.vertices.size());

    options.holes.policy = Holes::Flat;
    const SegmentResult flat = reconstruct(points, options);
    CHECK(flat.report.surface.closed);
    CHECK(flat.report.surface.genus == 0);
    CHECK(flat.report.surface.components == 1);
    CHECK(flat.report.surface.area == Approx(3 * kPi).epsilon(0.02));
    CHECK(flat.report.surface.volume == Approx(2 * kPi / 3).epsilon(0.02));
    TriangleMesh again = extract_mesh(*flat.surface);
    relax_mesh(again, *flat.surface);
    CHECK(measure(again).volume == Approx(flat.report.surface.volume));
    CHECK(flat.distance_to_points.size() == flat.mesh.vertices.size());

    options.holes.policy = Holes::Open;
    options.holes.distance = 3;  // no position is farther from the points, so there is no hole
    CHECK(reconstruct(points, options).report.surface.closed);
}
