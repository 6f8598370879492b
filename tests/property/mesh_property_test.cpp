// Meshes of random solids: closed, 2-manifold, outward, free of self-intersections and slivers, with the level set's
// topology.
#include <catch2/catch.hpp>
#include <cstdio>
#include <map>

#include "covol/mesh_cleanup.h"
#include "covol/mesh_relax.h"
#include "support/random_solids.h"

using namespace covol;
using namespace covol::test;

namespace {

constexpr unsigned kShapes = 200;

void check_valid(const TriangleMesh& mesh, const MeshMeasures& expected) {
    const MeshMeasures m = measure(mesh);
    CHECK(m.closed);
    CHECK(m.manifold);
    CHECK(m.volume > 0);
    CHECK(m.components == expected.components);
    CHECK(m.genus == expected.genus);
    CHECK(count_self_intersections(mesh) == 0);
}

/// The minimum of an angle, in degrees, for each kind of solid.
class MinimumAngles {
public:
    void add(const std::string& kind, double value) {
        const auto [at, first] = minimum_.try_emplace(kind, value);
        if (!first) at->second = std::min(at->second, value);
    }
    void print(const char* what) const {
        for (const auto& [kind, value] : minimum_)
            std::printf("%s: %s at least %.1f degrees\n", what, kind.c_str(), value);
    }

private:
    std::map<std::string, double> minimum_;
};

}  // namespace

TEST_CASE("200 random solids: relaxed meshes are valid, keep the topology, and have no slivers if resolved") {
    MinimumAngles min_angles;
    double maximum = 0, mean = 0;
    for (unsigned seed = 0; seed < kShapes; ++seed) {
        const RandomSolid solid = random_solid(seed);
        INFO("seed " << seed << ", " << solid.name);
        TriangleMesh mesh = extract_mesh(*solid.level_set);
        const MeshMeasures before = measure(mesh);
        REQUIRE(before.closed);
        const MeshDeviation deviation = measure_deviation(*solid.level_set, mesh);
        const RelaxReport report = relax_mesh(mesh, *solid.level_set);
        check_valid(mesh, before);
        // Parts that are thinner than the lattice resolves have no space for triangles as large as voxels. The minimum
        // angle of such a solid may therefore be less than 20 degrees, but not less than before relaxation.
        if (solid.resolved)
            CHECK(report.smallest_angle >= 20);
        else
            CHECK(report.smallest_angle >= report.smallest_angle_before);
        CHECK(report.deviation.mean < deviation.mean + 0.02);
        min_angles.add(solid.name, report.smallest_angle);
        maximum = std::max(maximum, report.deviation.max - deviation.max);
        mean = std::max(mean, report.deviation.mean);
    }
    min_angles.print("relaxed, 1st percentile of the smallest angles");
    std::printf("mean distance from the level set at most %.3f voxels; the largest grows by %.3f at most\n", mean,
                maximum);
}

TEST_CASE("200 random solids: decimated meshes are valid and keep the topology") {
    MinimumAngles min_angles;
    double change = 0;
    for (unsigned seed = 0; seed < kShapes; ++seed) {
        const RandomSolid solid = random_solid(seed);
        INFO("seed " << seed << ", " << solid.name);
        const double h = domain_of(*solid.level_set).voxel_size;
        TriangleMesh mesh = extract_mesh(*solid.level_set);
        relax_mesh(mesh, *solid.level_set);
        const MeshMeasures before = measure(mesh);
        const auto triangles = std::int64_t(mesh.triangles.size());
        CleanupOptions options;
        options.target_edge = (seed % 2 == 0 ? 2 : 4) * h;
        options.repair = false;
        const CleanupReport report = clean_mesh(mesh, *solid.level_set, 0.0, options);
        check_valid(mesh, before);
        CHECK(report.intersection_free);
        REQUIRE(report.decimation);
        CHECK(report.decimation->triangles < triangles);
        if (solid.resolved) min_angles.add(solid.name, report.decimation->smallest_angle);
        if (solid.resolved && seed % 2 == 0) change = std::max(change, report.decimation->change.mean / h);
    }
    min_angles.print("decimated, 1st percentile of the smallest angles");
    std::printf("to two voxels: mean distance from the mesh before at most %.3f voxels\n", change);
}

TEST_CASE("40 random solids: adaptive triangles stay within the tolerance") {
    MinimumAngles min_angles;
    for (unsigned seed = 0; seed < 40; ++seed) {
        const RandomSolid solid = random_solid(seed);
        INFO("seed " << seed << ", " << solid.name);
        const double h = domain_of(*solid.level_set).voxel_size;
        TriangleMesh mesh = extract_mesh(*solid.level_set);
        const double before_max = relax_mesh(mesh, *solid.level_set).deviation.max;
        const MeshMeasures before = measure(mesh);
        CleanupOptions options;
        options.adaptive = 0.1 * h;
        options.repair = false;
        const CleanupReport report = clean_mesh(mesh, *solid.level_set, 0.0, options);
        check_valid(mesh, before);
        CHECK(report.decimation->deviation.max < std::max(before_max, 0.1) + 1e-3);  // positions are rounded
        if (solid.resolved) min_angles.add(solid.name, report.decimation->smallest_angle);
    }
    min_angles.print("adaptive, 1st percentile of the smallest angles");
}

TEST_CASE("Relaxed and decimated meshes do not depend on the number of threads") {
    for (const unsigned seed : {0U, 4U, 5U, 8U}) {
        const RandomSolid solid = random_solid(seed);
        std::vector<TriangleMesh> meshes;
        for (const int threads : {1, 2, 8}) {
            RunContext run;
            run.threads = threads;
            TriangleMesh mesh = extract_mesh(*solid.level_set, {}, run);
            relax_mesh(mesh, *solid.level_set, {}, run);
            meshes.push_back(mesh);
            CleanupOptions options;
            options.target_edge = 2 * domain_of(*solid.level_set).voxel_size;
            clean_mesh(mesh, *solid.level_set, 0.0, options, run);
            meshes.push_back(mesh);
        }
        for (std::size_t n = 2; n < meshes.size(); ++n) {
            INFO("seed " << seed << ", mesh " << n);
            CHECK(meshes[n].vertices == meshes[n % 2].vertices);
            CHECK(meshes[n].triangles == meshes[n % 2].triangles);
        }
    }
}
