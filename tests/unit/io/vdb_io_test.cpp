#include "covol/vdb_io.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>

#include "support/scratch.h"

using namespace covol;

namespace {

FloatGridPtr sphere(const char* name, float radius = 1.0F) {
    const auto grid = openvdb::tools::createLevelSetSphere<FloatGrid>(radius, openvdb::Vec3f(0.3F, -0.2F, 5.0F), 0.1F);
    grid->setName(name);
    return grid;
}

bool same_tree(const FloatGrid& a, const FloatGrid& b) {
    bool same = a.activeVoxelCount() == b.activeVoxelCount() && a.tree().hasSameTopology(b.tree());
    for (auto voxel = a.cbeginValueAll(); voxel && same; ++voxel) same = *voxel == b.tree().getValue(voxel.getCoord());
    return same;
}

}  // namespace

TEST_CASE("VDB: equal grids give equal bytes, and other grids or metadata give another UUID") {
    const Scratch scratch;
    const auto bytes_of = [&](const char* name, float radius, const char* fact) {
        const std::string path = scratch.path(name);
        write_vdb(path, {sphere("surface", radius)}, {false, {{"fact", fact}}});
        std::ifstream file(path, std::ios::binary);
        return std::string{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    };
    constexpr std::size_t kUuid = 21, kLength = 36;  // position and length of the UUID in the header of a .vdb file
    const std::string one = bytes_of("a.vdb", 1, "x");
    CHECK(bytes_of("b.vdb", 1, "x") == one);
    CHECK(bytes_of("c.vdb", 1, "y").substr(kUuid, kLength) != one.substr(kUuid, kLength));
    CHECK(bytes_of("d.vdb", 1.5F, "x").substr(kUuid, kLength) != one.substr(kUuid, kLength));
    openvdb::io::File file(scratch.path("a.vdb"));
    file.open();
    CHECK(file.getUniqueTag() == one.substr(kUuid, kLength));
}

TEST_CASE("VDB: grids are read back as written, by name or the first one") {
    const Scratch scratch;
    const std::string path = scratch.path("two.vdb");
    const FloatGridPtr first = sphere("surface");
    const FloatGridPtr second = sphere("u", 1.5F);
    write_vdb(path, {first, second}, {false, {{"covol_delta", "0.35"}}});
    CHECK(scratch.file_count() == 1);  // no temporary file is left

    const FloatGridPtr read = read_vdb(path, "u");
    CHECK(same_tree(*read, *second));
    CHECK(read->transform() == second->transform());
    CHECK(read->getGridClass() == openvdb::GRID_LEVEL_SET);
    CHECK(read_vdb(path)->getName() == "surface");
    CHECK(same_tree(*read_vdb(path), *first));
    // The metadata are written to the file only: the caller's grids are not modified.
    CHECK(first->getCreator().empty());
    CHECK_FALSE(first->getMetadata<openvdb::StringMetadata>("covol_delta"));
}

TEST_CASE("VDB: the listing contains statistics, creator and provenance") {
    const Scratch scratch;
    const std::string path = scratch.path("one.vdb");
    const FloatGridPtr grid = sphere("surface");
    write_vdb(path, {grid}, {false, {{"covol_delta", "0.35"}}});
    const std::vector<VdbGridInfo> list = list_vdb(path);
    REQUIRE(list.size() == 1);
    CHECK(list[0].name == "surface");
    CHECK(list[0].type == "Tree_float_5_4_3");
    CHECK(list[0].grid_class == "level set");
    CHECK(list[0].voxel_size == Approx(0.1));
    CHECK(list[0].uniform);
    CHECK(list[0].active_voxels == grid->activeVoxelCount());
    const auto box = grid->evalActiveVoxelBoundingBox();
    CHECK(list[0].min == Index3{box.min()[0], box.min()[1], box.min()[2]});
    CHECK(list[0].max == Index3{box.max()[0], box.max()[1], box.max()[2]});
    CHECK(list[0].metadata.at("covol_delta") == "0.35");
    CHECK(list[0].metadata.at("creator").rfind("covol ", 0) == 0);
}

TEST_CASE("VDB: active voxels are counted if the file has no statistics") {
    const Scratch scratch;
    const std::string path = scratch.path("bare.vdb");
    const FloatGridPtr grid = sphere("d");
    openvdb::io::File file(path);
    file.setGridStatsMetadataEnabled(false);
    file.write(openvdb::GridPtrVec{grid});
    file.close();
    CHECK(list_vdb(path).at(0).active_voxels == grid->activeVoxelCount());
}

TEST_CASE("VDB: half floats are read as float grids, with the error of half precision") {
    const Scratch scratch;
    const std::string path = scratch.path("half.vdb");
    const FloatGridPtr grid = sphere("surface");
    write_vdb(path, {grid}, {true, {}});
    CHECK(list_vdb(path).at(0).type == "Tree_float_5_4_3_HalfFloat");
    const FloatGridPtr read = read_vdb(path, "surface");
    REQUIRE(read->activeVoxelCount() == grid->activeVoxelCount());
    double largest = 0;
    for (auto voxel = grid->cbeginValueOn(); voxel; ++voxel)
        largest = std::max(largest, std::abs(double(*voxel) - read->tree().getValue(voxel.getCoord())));
    CHECK(largest > 0);
    CHECK(largest < 0.3 / 2048);
}

TEST_CASE("VDB: grids that share one tree are read as equal grids") {
    const Scratch scratch;
    const std::string path = scratch.path("shared.vdb");
    const FloatGridPtr grid = sphere("a");
    const FloatGridPtr twin = grid->copy();
    twin->setName("b");
    write_vdb(path, {grid, twin});
    CHECK(same_tree(*read_vdb(path, "a"), *grid));
    CHECK(same_tree(*read_vdb(path, "b"), *grid));
    CHECK(list_vdb(path).at(1).active_voxels == grid->activeVoxelCount());
}

TEST_CASE("VDB: an empty grid is written and read") {
    const Scratch scratch;
    const std::string path = scratch.path("empty.vdb");
    const auto grid = FloatGrid::create(2.0F);
    grid->setName("density");
    write_vdb(path, {grid});
    CHECK(read_vdb(path)->background() == 2.0F);
    CHECK(list_vdb(path).at(0).active_voxels == 0);
}

TEST_CASE("VDB: a grid of another type is skipped, or rejected with its type if requested by name") {
    const Scratch scratch;
    const std::string path = scratch.path("mixed.vdb");
    const auto colour = openvdb::Vec3SGrid::create();
    colour->setName("Cd");
    openvdb::io::File file(path);
    file.write(openvdb::GridPtrVec{colour, sphere("surface")});
    file.close();
    CHECK(read_vdb(path)->getName() == "surface");
    const std::string message = message_of([&] { (void)read_vdb(path, "Cd"); });
    CHECK(message.find("Tree_vec3s_5_4_3") != std::string::npos);
    CHECK(message.find("surface (Tree_float_5_4_3)") != std::string::npos);
    CHECK(message_of([&] { (void)read_vdb(path, "u"); }).find("expected a grid named 'u'") != std::string::npos);
}

TEST_CASE("VDB: unusable names and paths are rejected, and no file remains") {
    const Scratch scratch;
    const FloatGridPtr grid = sphere("a");
    CHECK(message_of([&] { write_vdb(scratch.path("x.vdb"), {grid, grid}); }).find("'a' twice") != std::string::npos);
    grid->setName("");
    CHECK_THROWS_AS(write_vdb(scratch.path("x.vdb"), {grid}), Error);
    CHECK_THROWS_AS(write_vdb(scratch.path("x.vdb"), {nullptr}), Error);
    CHECK_THROWS_AS(write_vdb(scratch.path("no/such/folder/x.vdb"), {sphere("a")}), Error);
    CHECK(scratch.file_count() == 0);
    CHECK(message_of([&] { (void)read_vdb(scratch.path("none.vdb")); }).find("no such file") != std::string::npos);
    CHECK_THROWS_AS(read_vdb(scratch.write("text.vdb", "this is no grid\n")), Error);
    CHECK_THROWS_AS(read_vdb(scratch.write("zero.vdb", "")), Error);
    CHECK_THROWS_AS(list_vdb(scratch.write("text.vdb", std::string(5000, 'x'))), Error);
}

TEST_CASE("VDB: damaged files never crash the reader, and truncated ones are rejected") {
    const Scratch scratch;
    const std::string path = scratch.path("good.vdb");
    write_vdb(path, {sphere("surface", 0.5F)});
    const FuzzCounts counts = fuzz(
        scratch, path,
        [](const std::string& bad) {
            (void)list_vdb(bad);
            (void)read_vdb(bad);
        },
        60, 1500);
    CHECK(counts.truncated_accepted == 0);
}

TEST_CASE("VDB: each compression preserves the grid, and the listing states it") {
    const Scratch scratch;
    const FloatGridPtr level_set = sphere("surface"), other = sphere("u", 1.5F);
    other->setGridClass(openvdb::GRID_UNKNOWN);
    const auto names_of = [&](VdbCompression compression) {
        const std::string path = scratch.path("packed.vdb");
        write_vdb(path, {level_set, other}, {false, {}, compression});
        CHECK(same_tree(*read_vdb(path, "surface"), *level_set));
        CHECK(same_tree(*read_vdb(path, "u"), *other));
        const std::vector<VdbGridInfo> list = list_vdb(path);
        REQUIRE(list.size() == 2);
        return std::vector<std::string>{list[0].compression, list[1].compression};
    };
    CHECK(names_of(VdbCompression::None) == std::vector<std::string>{"none", "none"});
    // With zip, OpenVDB does not compress level sets.
    CHECK(names_of(VdbCompression::Zip) == std::vector<std::string>{"none", "zip"});
    CHECK(names_of(VdbCompression::Blosc) == std::vector<std::string>{"blosc", "blosc"});
}

TEST_CASE("NanoVDB: a file is written completely or not at all") {
    const Scratch scratch;
    const std::string path = scratch.path("a.nvdb");
    CHECK_THROWS_AS(write_nvdb(path, {sphere("a"), sphere("a")}), Error);
    CHECK(scratch.file_count() == 0);
    try {
        write_nvdb(path, {sphere("surface"), sphere("u", 1.5F)});
    } catch (const Error& error) {  // built without NanoVDB's headers
        CHECK(error.code() == Errc::Unsupported);
        CHECK(scratch.file_count() == 0);
        return;
    }
    CHECK(scratch.file_count() == 1);
    std::ifstream file(path, std::ios::binary);
    std::string magic(8, '\0');
    file.read(magic.data(), 8);
    CHECK(magic == "NanoVDB0");
    CHECK_THROWS_AS(write_nvdb(scratch.path("none/a.nvdb"), {sphere("a")}), Error);
}
