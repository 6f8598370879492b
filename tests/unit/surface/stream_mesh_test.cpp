#include "covol/mesh_stream.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <catch2/catch.hpp>

#include "covol/clip.h"
#include "covol/domain.h"
#include "covol/start.h"
#include "covol/surface.h"
#include "support/scratch.h"

using namespace covol;

namespace {

/// Checks that the streamed file and the measures equal those of write_mesh() and extract_mesh().
void check_same(const FloatGrid& surface, double isovalue, const WriteMeshOptions& options = {}) {
    const Scratch scratch;
    const TriangleMesh mesh = extract_mesh(surface, {isovalue});
    const MeshMeasures expected = measure(mesh);
    for (const char* end : {".ply", ".stl"}) {
        INFO(end);
        const std::string whole = scratch.path(std::string("whole") + end),
                          piece = scratch.path(std::string("piece") + end);
        write_mesh(whole, mesh, options);
        const StreamedMesh made = stream_mesh(piece, surface, isovalue, options);
        CHECK(bytes_of(whole) == bytes_of(piece));
        CHECK(made.vertices == mesh.vertices.size());
        CHECK(made.triangles == mesh.triangles.size());
        CHECK(made.measures.volume == expected.volume);
        CHECK(made.measures.area == expected.area);
        CHECK(made.measures.components == expected.components);
        CHECK(made.measures.genus == expected.genus);
        CHECK(made.measures.closed == expected.closed);
        CHECK(made.measures.manifold == expected.manifold);
        const StreamedMesh measured = measure_surface(surface, isovalue);
        CHECK(measured.triangles == made.triangles);
        CHECK(measured.measures.volume == expected.volume);
    }
    CHECK(scratch.file_count() == 4);
    const StreamedMesh made = stream_mesh(scratch.path("piece.obj"), surface, isovalue, options);
    const TriangleMesh back = read_mesh(scratch.path("piece.obj"));
    write_mesh(scratch.path("whole.obj"), mesh, options);
    const TriangleMesh other = read_mesh(scratch.path("whole.obj"));
    CHECK(back.vertices == other.vertices);
    CHECK(back.triangles == other.triangles);
    CHECK(made.triangles == back.triangles.size());
}

FloatGridPtr ring() {
    // A torus and a separate ball: genus 1, two pieces.
    const Domain domain{1.0, {0.3, 0.2, 0.1}, {-90, -90, -40}, {90, 90, 40}};
    const auto width = float(kHalfWidthVoxels);
    FloatGridPtr grid = make_grid(domain, width, "surface");
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    auto accessor = grid->getAccessor();
    for (int i = -90; i <= 90; ++i)
        for (int j = -90; j <= 90; ++j)
            for (int k = -40; k <= 40; ++k) {
                const double torus = std::hypot(std::hypot(i, j) - 60.0, k) - 20.3;
                const double ball = std::hypot(i, j, k) - 12.2;
                const auto d = float(std::min(torus, ball));
                if (std::abs(d) < width) accessor.setValueOn({i, j, k}, d);
                if (d <= -width) accessor.setValueOff({i, j, k}, -width);
            }
    return grid;
}

}  // namespace

TEST_CASE("A mesh streamed in pieces equals the mesh extracted at once") {
    const FloatGridPtr grid = ring();
    check_same(*grid, 0);
    check_same(*grid, 0.7);
    WriteMeshOptions options;
    options.y_up = true;
    options.unit_scale = 0.001;
    options.comments = {"one", "two\nlines"};
    check_same(*grid, 0, options);
    CHECK(stream_mesh(Scratch().path("a.ply"), *grid).measures.genus == 1);
}

TEST_CASE("A mesh streamed in pieces equals the extracted mesh, also for a solid cut by the image's faces") {
    const WorldBox box{{-30, -70, -35}, {70, 75, 14.4}};
    const FloatGridPtr grid = ring();
    set_clip(*grid, make_clip(box));
    check_same(*extract_surface(*grid), 0);
}

TEST_CASE("A mesh of more than 9000 leaves, which needs several pieces, is streamed correctly") {
    // 8192 leaves are processed as one piece, so that this sphere takes several pieces.
    const auto grid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(150.F, {0.3F, -0.4F, 0.1F}, 1.F);
    REQUIRE(grid->tree().leafCount() > 9000);
    check_same(*grid, 0);
}

TEST_CASE("Streaming without a surface, or to an unsupported format, is rejected and leaves no file") {
    const Scratch scratch;
    const FloatGridPtr grid = ring();
    CHECK_THROWS_WITH(stream_mesh(scratch.path("a.ply"), *grid, -100), Catch::Contains("no surface"));
    CHECK_THROWS_WITH(stream_mesh(scratch.path("a.glb"), *grid), Catch::Contains(".ply, .stl or .obj"));
    CHECK(scratch.file_count() == 0);
    CHECK(can_stream_mesh("A.PLY"));
    CHECK_FALSE(can_stream_mesh("a.off"));
}
