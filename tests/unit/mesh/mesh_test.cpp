#include "covol/mesh.h"

#include <tbb/parallel_for.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "base/disjoint_sets.h"
#include "support/meshes.h"

using namespace covol;
using covol::test::joined;

namespace {

TriangleMesh cube(float edge, float x0 = 0) {
    TriangleMesh mesh;
    for (int c = 0; c < 8; ++c)
        mesh.vertices.push_back({x0 + edge * float(c >> 2), edge * float(c >> 1 & 1), edge * float(c & 1)});
    mesh.triangles = {{0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}, {0, 4, 5}, {0, 5, 1},
                      {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
    return mesh;
}

/// A torus of n x m quads, each in two triangles.
TriangleMesh torus(int n, int m) {
    TriangleMesh mesh;
    const double pi = std::acos(-1.0);
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < m; ++j) {
            const double a = 2 * pi * i / n, b = 2 * pi * j / m, r = 2 + std::cos(b);
            mesh.vertices.push_back({float(r * std::cos(a)), float(r * std::sin(a)), float(std::sin(b))});
            const auto at = [&](int p, int q) { return std::uint32_t((i + p) % n * m + (j + q) % m); };
            mesh.triangles.push_back({at(0, 0), at(1, 0), at(1, 1)});
            mesh.triangles.push_back({at(0, 0), at(1, 1), at(0, 1)});
        }
    return mesh;
}

}  // namespace

TEST_CASE("Measures of a cube: volume, area, closed, manifold, genus 0") {
    const MeshMeasures m = measure(cube(2, 100));
    CHECK(m.volume == Approx(8));
    CHECK(m.area == Approx(24));
    CHECK(m.components == 1);
    CHECK(m.genus == 0);
    CHECK(m.closed);
    CHECK(m.manifold);
}

TEST_CASE("The volume of an inside-out mesh is negative") {
    TriangleMesh mesh = cube(1);
    for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
    CHECK(measure(mesh).volume == Approx(-1));
    CHECK(measure(mesh).closed);
}

TEST_CASE("A torus has genus 1, and with a separate cube there are two components") {
    const MeshMeasures m = measure(joined(torus(24, 12), cube(1, 50)));
    CHECK(m.genus == 1);
    CHECK(m.components == 2);
    CHECK(measure(torus(200, 100)).volume == Approx(4 * std::pow(std::acos(-1.0), 2)).epsilon(0.002));
}

TEST_CASE("Measures detect holes, flipped and degenerate triangles, and shared edges and corners") {
    TriangleMesh open = cube(1);
    open.triangles.pop_back();
    CHECK_FALSE(measure(open).closed);
    CHECK(measure(open).manifold);
    CHECK(measure(open).genus == -1);

    TriangleMesh flipped = cube(1);
    std::swap(flipped.triangles[3][0], flipped.triangles[3][1]);
    CHECK_FALSE(measure(flipped).closed);

    TriangleMesh corner = joined(cube(1), cube(1, 5));
    for (auto& t : corner.triangles)
        for (auto& v : t) v = v == 8 ? 7 : v;
    CHECK(measure(corner).closed);
    CHECK_FALSE(measure(corner).manifold);
    CHECK(measure(corner).components == 2);
    CHECK(measure(corner).genus == 0);

    TriangleMesh edge = corner;
    for (auto& t : edge.triangles)
        for (auto& v : t) v = v == 9 ? 6 : v;
    CHECK_FALSE(measure(edge).closed);
    CHECK_FALSE(measure(edge).manifold);

    TriangleMesh degenerate = cube(1);
    degenerate.triangles.push_back({0, 1, 1});
    CHECK_FALSE(measure(degenerate).manifold);
    CHECK(measure(TriangleMesh{}).components == 0);
}

TEST_CASE("Vertex normals have unit length, are weighted by angle and point outwards") {
    const TriangleMesh mesh = cube(1);
    const auto normals = compute_vertex_normals(mesh);
    REQUIRE(normals.size() == 8);
    // The normals lie exactly along the diagonals, because they are weighted by angle and not by number of triangles.
    for (int c = 0; c < 8; ++c)
        for (int a = 0; a < 3; ++a)
            CHECK(normals[c][a] == Approx((c >> (2 - a) & 1 ? 1 : -1) / std::sqrt(3.0)).epsilon(1e-6));
}

TEST_CASE("Components below the minimum volume and unused vertices are removed") {
    TriangleMesh mesh = joined(joined(cube(0.5F, 10), cube(2)), cube(1, 20));
    mesh.vertices.push_back({9, 9, 9});
    remove_small_components(mesh, 0.5);
    CHECK(mesh.vertices.size() == 16);
    CHECK(measure(mesh).components == 2);
    CHECK(measure(mesh).volume == Approx(9));
    remove_small_components(mesh, 1000);
    CHECK(mesh.empty());
    CHECK(mesh.vertices.empty());
}

TEST_CASE("Disjoint sets united by many threads have the minimum member as root, as by a flood fill") {
    constexpr std::uint32_t kCount = 200000;
    std::mt19937 random(3);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs(kCount * 3 / 4);
    for (auto& [a, b] : pairs) a = std::uint32_t(random() % kCount), b = std::uint32_t(random() % kCount);
    // The expected result, by a flood fill from each number in ascending order: a set is known by its minimum member.
    std::vector<std::vector<std::uint32_t>> adjacent(kCount);
    for (const auto& [a, b] : pairs) {
        adjacent[a].push_back(b);
        adjacent[b].push_back(a);
    }
    std::vector<std::uint32_t> expected(kCount, kCount), work;
    for (std::uint32_t n = 0; n < kCount; ++n)
        for (work.assign(expected[n] == kCount ? 1 : 0, n); !work.empty();) {
            const std::uint32_t at = work.back();
            work.pop_back();
            if (expected[at] != kCount) continue;
            expected[at] = n;
            work.insert(work.end(), adjacent[at].begin(), adjacent[at].end());
        }
    for (int repeat = 0; repeat < 5; ++repeat) {
        detail::DisjointSets sets(kCount);
        tbb::parallel_for(std::size_t(0), pairs.size(),
                          [&](std::size_t n) { sets.unite(pairs[n].first, pairs[n].second); });
        bool same = true;
        for (std::uint32_t n = 0; n < kCount; ++n) same &= sets.root(n) == expected[n];
        CHECK(same);
    }
}
