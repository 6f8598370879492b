#include "covol/mesh_cleanup.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "covol/error.h"
#include "support/meshes.h"

using namespace covol;
using covol::test::joined;

namespace {

const double kPi = std::acos(-1.0);

/// A sphere of n rings of 2 n quads, closed at the poles.
TriangleMesh sphere(int n, float radius, float x0 = 0) {
    TriangleMesh mesh;
    mesh.vertices.push_back({x0, 0, radius});
    const int m = 2 * n;
    for (int i = 1; i < n; ++i)
        for (int j = 0; j < m; ++j) {
            const double a = kPi * i / n, b = 2 * kPi * j / m;
            mesh.vertices.push_back({x0 + radius * float(std::sin(a) * std::cos(b)),
                                     radius * float(std::sin(a) * std::sin(b)), radius * float(std::cos(a))});
        }
    mesh.vertices.push_back({x0, 0, -radius});
    const auto at = [&](int i, int j) {
        return i == 0 ? 0U : i == n ? std::uint32_t(mesh.vertices.size() - 1) : std::uint32_t(1 + (i - 1) * m + j % m);
    };
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < m; ++j) {
            if (i + 1 < n) mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            if (i > 0) mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    return mesh;
}

TriangleMesh two_triangles(std::array<float, 3> d, std::array<float, 3> e, std::array<float, 3> f) {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, d, e, f};
    mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
    return mesh;
}

void check_proper(const TriangleMesh& mesh, const CleanupReport& report) {
    CHECK(report.closed);
    CHECK(report.manifold);
    CHECK(report.intersection_free);
    CHECK(measure(mesh).closed);
    CHECK(measure(mesh).volume > 0);
}

}  // namespace

TEST_CASE("Self-intersections are counted in pairs, and contact at shared corners or edges does not count") {
    CHECK(count_self_intersections(sphere(8, 1)) == 0);
    CHECK(count_self_intersections(two_triangles({0.5F, 0.5F, -1}, {0.5F, 0.6F, 1}, {0.6F, 0.5F, 1})) == 1);
    CHECK(count_self_intersections(two_triangles({0.5F, 0.5F, 1}, {0.5F, 0.6F, 2}, {0.6F, 0.5F, 2})) == 0);
    // The second triangle starts at corner 0 of the first one and passes through it.
    TriangleMesh corner = two_triangles({0, 0, 0}, {1, 1, 1}, {1, 1, -1});
    corner.triangles[1][0] = 0;
    CHECK(count_self_intersections(corner) == 1);
    corner.vertices[4] = {-1, 1, 1};
    corner.vertices[5] = {-1, 1, -1};
    CHECK(count_self_intersections(corner) == 0);
    // Two triangles in one plane, on the same side of their common edge 0-1.
    TriangleMesh side = two_triangles({0, 0, 0}, {0, 0, 0}, {1, 1, 0});
    side.triangles[1] = {1, 0, 5};
    CHECK(count_self_intersections(side) == 1);
    side.vertices[5] = {1, -1, 0};
    CHECK(count_self_intersections(side) == 0);
    side.triangles[1] = {0, 1, 9};
    CHECK_THROWS_AS(count_self_intersections(side), Error);
}

TEST_CASE("Crossings between components are distinguished from crossings within a component") {
    const Crossings apart = count_crossings(joined(sphere(8, 1), sphere(8, 1, 3)));
    CHECK((apart.within == 0 && apart.between == 0));
    const TriangleMesh both = joined(sphere(8, 1), sphere(8, 1, 1));
    const Crossings crossed = count_crossings(both);
    CHECK(crossed.within == 0);
    CHECK(crossed.between > 0);
    CHECK(count_self_intersections(both) == crossed.between);
    // A third piece intersects itself: it consists of two triangles that are joined at a corner and cross each other.
    TriangleMesh corner = two_triangles({0, 0, 0}, {1, 1, 1}, {1, 1, -1});
    corner.triangles[1][0] = 0;
    for (auto& v : corner.vertices) v[0] += 10;
    const Crossings all = count_crossings(joined(both, corner));
    CHECK(all.within == 1);
    CHECK(all.between == crossed.between);
}

TEST_CASE("Cleaning leaves a valid mesh unchanged") {
    const TriangleMesh before = sphere(10, 1);
    TriangleMesh mesh = before;
    const CleanupReport report = clean_mesh(mesh);
    check_proper(mesh, report);
    CHECK(report.self_intersections == 0);
    CHECK(report.holes_filled == 0);
    CHECK(mesh.vertices == before.vertices);
    CHECK(mesh.triangles == before.triangles);
}

TEST_CASE("Cleaning fills holes and reorients an inside-out mesh") {
    TriangleMesh mesh = sphere(10, 1);
    mesh.triangles.erase(mesh.triangles.begin() + 70);
    mesh.triangles.erase(mesh.triangles.begin(), mesh.triangles.begin() + 15);
    const CleanupReport report = clean_mesh(mesh);
    check_proper(mesh, report);
    CHECK(report.holes_filled == 2);
    CHECK(measure(mesh).genus == 0);

    mesh = sphere(10, 1);
    const double volume = measure(mesh).volume;
    for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
    check_proper(mesh, clean_mesh(mesh));
    CHECK(measure(mesh).volume == Approx(volume));
}

TEST_CASE("Cleaning makes two surfaces that share a vertex manifold") {
    TriangleMesh mesh = joined(sphere(6, 1), sphere(6, 1, 2));
    // Vertex 0 of the second sphere becomes vertex 0 of the first, moved to the middle.
    const auto half = std::uint32_t(mesh.vertices.size() / 2);
    mesh.vertices[0] = {1, 0, 1.5F};
    for (auto& t : mesh.triangles)
        for (auto& v : t) v = v == half ? 0 : v;
    REQUIRE_FALSE(measure(mesh).manifold);
    const CleanupReport report = clean_mesh(mesh);
    CHECK(report.closed);
    CHECK(report.manifold);
}

TEST_CASE("Cleaning removes a local fold") {
    TriangleMesh mesh = sphere(16, 1);
    // One vertex is pushed through the opposite side of its neighbourhood.
    mesh.vertices[200] = {mesh.vertices[203][0] * 1.02F, mesh.vertices[203][1] * 1.02F, mesh.vertices[203][2] * 0.98F};
    REQUIRE(count_self_intersections(mesh) > 0);
    const CleanupReport report = clean_mesh(mesh);
    CHECK(report.self_intersections > 0);
    check_proper(mesh, report);
    CHECK(measure(mesh).volume == Approx(4.0 / 3 * kPi).epsilon(0.05));
}

TEST_CASE("Decimation reaches the target edge length and preserves the volume") {
    TriangleMesh mesh = sphere(50, 1);
    const double volume = measure(mesh).volume;
    CleanupOptions options;
    options.target_edge = 0.2;
    const CleanupReport report = clean_mesh(mesh, options);
    check_proper(mesh, report);
    const MeshMeasures m = measure(mesh);
    CHECK(m.volume == Approx(volume).epsilon(0.01));
    const double edge = std::sqrt(m.area / double(mesh.triangles.size()) * 4 / std::sqrt(3.0));
    CHECK(edge == Approx(0.2).epsilon(0.1));
}

TEST_CASE("Smoothing reduces noise and preserves the volume") {
    TriangleMesh mesh = sphere(24, 1);
    const double volume = measure(mesh).volume;
    std::mt19937 random(5);
    std::uniform_real_distribution<float> noise(-0.005F, 0.005F);
    for (auto& v : mesh.vertices)
        for (float& c : v) c += noise(random);
    const auto roughness = [&] {  // root mean square distance of the vertices from the sphere
        double sum = 0;
        for (const auto& v : mesh.vertices) sum += std::pow(std::hypot(v[0], v[1], v[2]) - 1, 2);
        return std::sqrt(sum / double(mesh.vertices.size()));
    };
    const double before = roughness();
    CleanupOptions options;
    options.smooth_iterations = 20;
    check_proper(mesh, clean_mesh(mesh, options));
    CHECK(roughness() < 0.7 * before);
    CHECK(measure(mesh).volume == Approx(volume).epsilon(0.01));
}

TEST_CASE("Cleanup options out of range are rejected") {
    TriangleMesh mesh = sphere(4, 1);
    CleanupOptions options;
    options.target_edge = -1;
    options.smooth_iterations = -2;
    CHECK_THAT(why_invalid(options), Catch::Contains("target_edge") && Catch::Contains("smooth"));
    CHECK_THROWS_AS(clean_mesh(mesh, options), Error);
}

TEST_CASE("The wall of a slab is as thick as the distance of its faces, and negative without opposite faces") {
    // A slab of 4 x 4 x 0.25, its large faces in two triangles each.
    TriangleMesh slab;
    for (const float z : {0.0F, 0.25F})
        for (const float y : {0.0F, 4.0F})
            for (const float x : {0.0F, 4.0F}) slab.vertices.push_back({x, y, z});
    slab.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    REQUIRE(measure(slab).volume == Approx(4));
    CHECK(measure_wall(slab) == Approx(0.25));
    CHECK(measure_wall({}) < 0);
    // A single triangle has no wall, because nothing lies opposite to it.
    TriangleMesh open = slab;
    open.triangles.resize(1);
    CHECK(measure_wall(open) < 0);
}
