#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

#include "covol/domain.h"
#include "covol/error.h"
#include "covol/mesh_cleanup.h"
#include "covol/mesh_relax.h"
#include "covol/start.h"
#include "covol/surface.h"
#include "grid/cube_cases.h"

using namespace covol;

namespace {

constexpr double kPi = 3.14159265358979323846;

/// A grid with the values clamp(f, -3h, 3h) in all voxels of [-n, n]^3, in leaves; elsewhere it has the background 3h.
FloatGridPtr dense_grid(int n, double h, const Vec3& origin, const std::function<double(const Vec3&)>& f) {
    Domain domain;
    domain.voxel_size = h;
    domain.origin = origin;
    domain.min = {-n, -n, -n};
    domain.max = {n, n, n};
    FloatGridPtr grid = make_grid(domain, float(3 * h), "surface");
    auto accessor = grid->getAccessor();
    for (int i = -n; i <= n; ++i)
        for (int j = -n; j <= n; ++j)
            for (int k = -n; k <= n; ++k) {
                const double value = f(domain.index_to_world({double(i), double(j), double(k)}));
                accessor.setValue({i, j, k}, float(std::clamp(value, -3 * h, 3 * h)));
            }
    return grid;
}

double norm(const Vec3& p) { return std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]); }

void check_solid(const TriangleMesh& mesh) {
    const MeshMeasures m = measure(mesh);
    CHECK(m.closed);
    CHECK(m.manifold);
    CHECK(m.volume > 0);
    CHECK(count_self_intersections(mesh) == 0);
}

}  // namespace

TEST_CASE("Each cube case uses every edge between corners of different sign once, and no other edge") {
    for (int inside = 0; inside < 256; ++inside) {
        const auto& cube = detail::kCubeCases[inside];
        std::array<int, 12> uses{};
        for (int l = 0; l < cube.loop_count; ++l)
            for (int i = 0; i < cube.loops[l].size; ++i) ++uses[cube.loops[l].edges[i]];
        for (int e = 0; e < 12; ++e) {
            const bool cut = (inside >> detail::kEdgeStart[e] & 1) != (inside >> detail::edge_end(e) & 1);
            CHECK(uses[e] == int(cut));
        }
    }
}

TEST_CASE("All 255 cubes with inside corners give closed manifold surfaces without self-intersections") {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> size(0.001F, 1.0F);
    for (int inside = 1; inside < 256; ++inside) {
        FloatGridPtr grid = make_grid({}, 1.0F, "surface");
        for (int c = 0; c < 8; ++c)
            if (inside >> c & 1)
                grid->tree().setValue({c >> 2, c >> 1 & 1, c & 1}, -size(random));
            else
                grid->tree().setValue({c >> 2, c >> 1 & 1, c & 1}, size(random));
        INFO("inside corners " << inside);
        check_solid(extract_mesh(*grid));
    }
}

TEST_CASE("Random signs in all voxels give closed manifold surfaces without self-intersections") {
    for (const double probability : {0.05, 0.3, 0.5, 0.7, 0.95})
        for (const unsigned seed : {1U, 2U}) {
            std::mt19937 random(seed);
            std::uniform_real_distribution<double> uniform(0, 1);
            const FloatGridPtr grid = dense_grid(9, 0.3, {10, -20, 7}, [&](const Vec3&) {
                const double size = std::pow(uniform(random), 4);
                return uniform(random) < probability ? -size : size;
            });
            INFO("seed " << seed << ", fraction inside " << probability);
            check_solid(extract_mesh(*grid));
        }
}

TEST_CASE("The inside is 6-connected: voxels that touch at an edge or a corner stay separate") {
    FloatGridPtr grid = make_grid({}, 1.0F, "surface");
    for (const openvdb::Coord& c : {openvdb::Coord(7, 7, 7), openvdb::Coord(8, 8, 7), openvdb::Coord(9, 9, 8)})
        grid->tree().setValue(c, -1.0F);
    const TriangleMesh mesh = extract_mesh(*grid);
    check_solid(mesh);
    CHECK(measure(mesh).components == 3);
}

// The edges of triangles are chords, which cut off a fraction of O((h/r)^2) of the volume.
TEST_CASE("The mesh of a sphere has its volume, area and genus, and its vertices lie on the sphere") {
    const double r = 1.0, h = 0.1;
    const Vec3 centre{5.03, -2.01, 0.02};
    const auto grid = dense_grid(14, h, {5, -2, 0}, [&](const Vec3& p) {
        return norm({p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]}) - r;
    });
    const TriangleMesh mesh = extract_mesh(*grid);
    check_solid(mesh);
    const MeshMeasures m = measure(mesh);
    CHECK(m.components == 1);
    CHECK(m.genus == 0);
    CHECK(m.volume == Approx(4.0 / 3 * kPi * r * r * r).epsilon(0.01));
    CHECK(m.area == Approx(4 * kPi * r * r).epsilon(0.01));
    double worst = 0;
    for (const auto& v : mesh.vertices)
        worst = std::max(worst, std::abs(norm({v[0] - centre[0], v[1] - centre[1], v[2] - centre[2]}) - r));
    CHECK(worst < 0.02 * h);

    ExtractOptions larger;
    larger.isovalue = 0.5 * h;
    CHECK(measure(extract_mesh(*grid, larger)).volume ==
          Approx(4.0 / 3 * kPi * std::pow(r + 0.5 * h, 3)).epsilon(0.01));
}

TEST_CASE("The mesh of a torus has genus 1 and the volume of the torus") {
    const auto grid = dense_grid(16, 0.1, {0, 0, 0},
                                 [](const Vec3& p) { return std::hypot(std::hypot(p[0], p[1]) - 1.0, p[2]) - 0.4; });
    const TriangleMesh mesh = extract_mesh(*grid);
    check_solid(mesh);
    CHECK(measure(mesh).genus == 1);
    CHECK(measure(mesh).volume == Approx(2 * kPi * kPi * 0.16).epsilon(0.015));
}

TEST_CASE("Touching spheres and a sheet thinner than a voxel give closed manifold meshes") {
    const auto touching = dense_grid(16, 0.1, {0, 0, 0}, [](const Vec3& p) {
        return std::min(norm({p[0] - 0.7, p[1], p[2]}), norm({p[0] + 0.7, p[1], p[2]})) - 0.7;
    });
    check_solid(extract_mesh(*touching));
    const auto sheet = dense_grid(12, 0.1, {0, 0, 0}, [](const Vec3& p) {
        return std::max(std::abs(p[2] + 0.31 * p[0] + 0.2 * p[1]) - 0.02, norm(p) - 1.0);
    });
    check_solid(extract_mesh(*sheet));
}

TEST_CASE("Components below the minimum volume are removed on request") {
    const auto grid = dense_grid(14, 0.1, {0, 0, 0}, [](const Vec3& p) {
        return std::min(norm({p[0] - 0.3, p[1], p[2]}) - 0.8, norm({p[0] + 1.0, p[1], p[2]}) - 0.2);
    });
    CHECK(measure(extract_mesh(*grid)).components == 2);
    ExtractOptions options;
    options.min_component_volume = 0.5;
    const TriangleMesh kept = extract_mesh(*grid, options);
    check_solid(kept);
    CHECK(measure(kept).components == 1);
}

TEST_CASE("Inside tiles without adjacent leaves have closed surfaces") {
    FloatGridPtr grid = make_grid({}, 1.0F, "surface");
    grid->tree().addTile(1, {0, 0, 0}, -1.0F, false);    // 8^3
    grid->tree().addTile(1, {8, 8, 0}, -1.0F, true);     // touches the first tile at an edge
    grid->tree().addTile(2, {256, 0, 0}, -1.0F, false);  // 128^3
    grid->tree().setValue({-1, -1, 8}, -0.5F);
    const TriangleMesh mesh = extract_mesh(*grid);
    const MeshMeasures m = measure(mesh);
    CHECK(m.closed);
    CHECK(m.manifold);
    CHECK(m.components == 4);
    CHECK(m.volume == Approx(2 * 512.0 + 128.0 * 128 * 128).epsilon(0.01));
}

TEST_CASE("The mesh is independent of the number of threads") {
    const auto grid = dense_grid(
        20, 0.1, {0, 0, 0}, [](const Vec3& p) { return std::sin(4 * p[0]) + std::sin(5 * p[1]) + std::sin(6 * p[2]); });
    RunContext run;
    run.threads = 1;
    const TriangleMesh reference = extract_mesh(*grid, {}, run);
    CHECK(reference.triangles.size() > 1000);
    for (const int threads : {2, 8}) {
        run.threads = threads;
        const TriangleMesh mesh = extract_mesh(*grid, {}, run);
        CHECK(mesh.vertices == reference.vertices);
        CHECK(mesh.triangles == reference.triangles);
    }
}

TEST_CASE("Grids without a closed surface are rejected, and an empty grid gives an empty mesh") {
    CHECK(extract_mesh(*make_grid({}, 1.0F, "surface")).empty());
    CHECK_THROWS_AS(extract_mesh(*make_grid({}, -1.0F, "surface")), Error);
    ExtractOptions options;
    options.min_component_volume = 0.5;  // there is no component that could be too small
    CHECK(extract_mesh(*make_grid({}, 1.0F, "surface"), options).empty());
    FloatGridPtr grid = make_grid({}, 1.0F, "surface");
    grid->tree().setValue({0, 0, 0}, -1.0F);
    options = {};
    options.isovalue = 2.0;
    CHECK_THROWS_AS(extract_mesh(*grid, options), Error);
    grid->tree().setValue({1, 0, 0}, std::nanf(""));
    CHECK_THROWS_AS(extract_mesh(*grid), Error);
    grid = make_grid({}, 1.0F, "surface");
    grid->tree().setValue({0, 0, 0}, -1.0F);
    grid->tree().setValue({1 << 24, 0, 0}, -1.0F);  // too far apart for single precision
    CHECK_THROWS_AS(extract_mesh(*grid), Error);
}

TEST_CASE("A surface far from the origin is the same surface, translated") {
    const Domain near{0.1, {0, 0, 0}, {-20, -20, -20}, {20, 20, 20}};
    Domain far = near;
    far.origin = {500000.05, 5400000, -300};
    const FloatGridPtr u = start_from_sphere(near, {0.02, 0, 0}, 1.5),
                       v = start_from_sphere(far, {500000.07, 5400000, -300}, 1.5);
    TriangleMesh here = extract_mesh(*u), there = extract_mesh(*v);
    CHECK(here.origin == Vec3{0, 0, 0});
    CHECK(there.origin[1] == 5400000);
    CHECK(here.triangles.size() == there.triangles.size());
    const MeshMeasures measured = measure(there);
    CHECK(measured.closed);
    CHECK(measured.genus == 0);
    CHECK(measured.volume == Approx(measure(here).volume).epsilon(1e-4));
    const RelaxReport relaxed = relax_mesh(there, *v);
    CHECK(relaxed.deviation.mean < 0.02);
    for (std::size_t n = 0; n < there.vertices.size(); n += 7) {
        const Vec3 p = there.place(n);
        CHECK(std::abs(std::hypot(p[0] - 500000.07, p[1] - 5400000, p[2] + 300) - 1.5) < 0.01);
    }
    CHECK(measure_fit({{500001.57, 5400000, -300}}, there).max < 0.01);
}
