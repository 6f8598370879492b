#include "covol/mesh_io.h"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

#include "covol/error.h"
#include "covol/points.h"

using namespace covol;
namespace fs = std::filesystem;

namespace {

/// A folder that is removed at the end of the test.
struct Folder {
    fs::path path = fs::temp_directory_path() / ("covol_mesh_io_test_" + std::to_string(::getpid()));
    Folder() { fs::create_directories(path); }
    ~Folder() { fs::remove_all(path); }
    [[nodiscard]] std::string file(const std::string& name) const { return (path / name).string(); }
    [[nodiscard]] std::string file(const std::string& name, const std::string& text) const {
        std::ofstream(path / name, std::ios::binary) << text;
        return file(name);
    }
};

std::string text_of(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

TriangleMesh tetrahedron() {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1.1F, 0, 0}, {0, 2.3F, 0}, {0, 0, 1.0F / 3}};
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    return mesh;
}

void check_refused(const std::string& path, const std::string& part, Errc code = Errc::InvalidInput) {
    INFO(path);
    try {
        static_cast<void>(read_mesh(path));
        FAIL("was read");
    } catch (const Error& e) {
        CHECK_THAT(e.what(), Catch::Contains(part));
        CHECK(e.code() == code);
    }
}

template <typename T>
std::string big_endian(T value) {
    std::string bytes(sizeof(T), '\0');
    std::memcpy(bytes.data(), &value, sizeof(T));
    return {bytes.rbegin(), bytes.rend()};
}

}  // namespace

TEST_CASE("PLY, OBJ and OFF are read back bit for bit, as text and binary, and STL with the same volume") {
    const Folder folder;
    const TriangleMesh mesh = tetrahedron();
    WriteMeshOptions options;
    options.comments = {"covol test", "two\nlines"};
    for (const char* end : {"ply", "obj", "off"})
        for (const bool binary : {true, false}) {
            options.binary = binary;
            const std::string path = folder.file(std::string("a.") + end);
            write_mesh(path, mesh, options);
            INFO(path);
            const TriangleMesh back = read_mesh(path);
            CHECK(back.vertices == mesh.vertices);
            CHECK(back.triangles == mesh.triangles);
            CHECK_THAT(text_of(path), Catch::Contains("covol test") && Catch::Contains("two lines"));
        }
    for (const bool binary : {true, false}) {
        options.binary = binary;
        write_mesh(folder.file("a.stl"), mesh, options);
        const TriangleMesh back = read_mesh(folder.file("a.stl"));
        CHECK(back.vertices.size() == 4);
        CHECK(measure(back).closed);
        CHECK(measure(back).volume == Approx(measure(mesh).volume));
    }
}

TEST_CASE("Writing with y up and a unit scale preserves the orientation of the mesh") {
    const Folder folder;
    WriteMeshOptions options;
    options.y_up = true;
    options.unit_scale = 0.5;
    write_mesh(folder.file("a.ply"), tetrahedron(), options);
    const TriangleMesh back = read_mesh(folder.file("a.ply"));
    CHECK(back.vertices[2] == std::array<float, 3>{0, 0, -1.15F});
    CHECK(back.vertices[3][1] == Approx(0.5 / 3));
    CHECK(measure(back).volume == Approx(measure(tetrahedron()).volume / 8));
}

TEST_CASE("GLB: two aligned chunks are written whose sizes match the data") {
    const Folder folder;
    WriteMeshOptions options;
    options.comments = {"delta = 1"};
    write_mesh(folder.file("a.glb"), tetrahedron(), options);
    const std::string data = text_of(folder.file("a.glb"));
    const auto word = [&](std::size_t at) {
        std::uint32_t value = 0;
        std::memcpy(&value, data.data() + at, 4);
        return value;
    };
    REQUIRE(data.substr(0, 4) == "glTF");
    CHECK(word(4) == 2);  // the version
    CHECK(word(8) == data.size());
    const std::uint32_t json = word(12);
    CHECK(json % 4 == 0);
    CHECK(data.substr(16, 4) == "JSON");
    CHECK_THAT(data.substr(20, json), Catch::Contains("delta = 1") && Catch::Contains("\"NORMAL\":1"));
    CHECK(word(20 + json) == 4 * 12 * 2 + 4 * 12);
    CHECK(word(24 + json) == 0x004E4942);
    CHECK(data.size() == 28 + json + 4 * 12 * 3);
    float x = 0;
    std::memcpy(&x, data.data() + 28 + json + 12, 4);
    CHECK(x == 1.1F);
}

TEST_CASE("PLY of other programs: big-endian bytes, doubles, other properties and elements, polygons") {
    const Folder folder;
    std::string text =
        "ply\r\nformat binary_big_endian 1.0\nobj_info x\nelement camera 1\nproperty float f\nelement vertex 4\n"
        "property uchar red\nproperty double x\nproperty double y\nproperty double z\n"
        "element face 1\nproperty list uchar int vertex_index\nproperty list ushort float texcoord\nend_header\n";
    text += big_endian(1.0F);
    for (const auto& p : {Vec3{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}) {
        text += '\xff';
        for (const double c : p) text += big_endian(c);
    }
    text += '\x04';
    for (const int v : {0, 1, 2, 3}) text += big_endian(v);
    text += big_endian(std::uint16_t(2)) + big_endian(0.5F) + big_endian(0.5F);
    const TriangleMesh mesh = read_mesh(folder.file("a.ply", text));
    CHECK(mesh.triangles.size() == 2);
    CHECK(measure(mesh).area == Approx(1));
    text.pop_back();
    check_refused(folder.file("cut.ply", text), "cut off");
}

TEST_CASE("OBJ with slashes, negative indices and groups, and OFF with colours and comments, are read") {
    const Folder folder;
    const TriangleMesh obj = read_mesh(folder.file("a.obj",
                                                   "# c\no thing\nv 0 0 0\nv +1 0 0 1.0\nv 1e0 1 0\nv 0 1 0\nvt 0 "
                                                   "0\nvn 0 0 1\ns off\nf 1/1/1 2//1 3/1 # c\nf -4 -2 -1\n"));
    CHECK(obj.triangles.size() == 2);
    CHECK(measure(obj).area == Approx(1));
    const TriangleMesh off = read_mesh(
        folder.file("a.off", "COFF 4 1 0\n# c\n0 0 0 255 0 0 1\n1 0 0\n\n1 1 0\n0 1 0\n4 0 1 2 3 0.5 0.5 0.5"));
    CHECK(measure(off).area == Approx(1));
}

TEST_CASE("Malformed and malicious mesh files are rejected with a specific error") {
    const Folder folder;
    const std::string vertex = "property float x\nproperty float y\nproperty float z\n";
    const std::string face = "property list uchar int vertex_indices\n";
    const std::string ascii = "ply\nformat ascii 1.0\n", binary = "ply\nformat binary_little_endian 1.0\n";
    check_refused(folder.file("missing.ply"), "cannot be opened", Errc::Io);
    check_refused(folder.path.string(), "expected a name", Errc::Unsupported);
    check_refused(folder.file("a.fbx", "x"), "expected a name", Errc::Unsupported);
    check_refused(folder.file("a.ply", ""), "end of the file");
    check_refused(folder.file("a.ply", "plx\n"), "expected 'ply'");
    for (const std::string& format : {ascii, binary}) {
        check_refused(folder.file("a.ply", format + "element vertex 1000000000000\n" + vertex + "end_header\n0 0 0\n"),
                      "room for at most");
        check_refused(
            folder.file("a.ply", format + "element vertex 18446744073709551615\n" + vertex + "end_header\n0 0 0\n"),
            "room");
        check_refused(folder.file("a.ply", format + "element face 99999999\n" + face + "end_header\n0 0 0\n"), "room");
    }
    check_refused(folder.file("a.ply", ascii + "element vertex 99999999999999999999999\n" + vertex + "end_header\n"),
                  ":3: expected");
    check_refused(folder.file("a.ply", ascii + "element vertex 1000000000000\nend_header\n0 0 0\n"), "no property 'x'");
    check_refused(folder.file("a.ply", ascii + "element x 1000000000000\nend_header\n"), "no triangle");
    check_refused(folder.file("a.ply", ascii + "element vertex 1\n" + vertex + "end_header\n0 zero 0\n"),
                  ":8: expected a number, got 'zero'");
    check_refused(folder.file("a.ply", ascii + "element vertex 1\n" + vertex + "element face 1\n" + face +
                                           "end_header\n0 0 0\n3 0 x 0\n"),
                  "expected a number, got 'x'");
    check_refused(folder.file("a.ply", ascii + "element vertex 1\n" + vertex + "end_header\n0 nan 0\n"), "not finite");
    check_refused(folder.file("a.ply", ascii + "element face 1\n" + face + "end_header\n3 0 1 2\n"),
                  "refers to vertex 0");
    check_refused(folder.file("a.ply", ascii + "element face 1\n" + face + "end_header\n3 0 1 -2\n"),
                  "number of a vertex");
    check_refused(folder.file("a.ply", ascii + "element face 1\n" + face + "end_header\n1e18 0 1 2\n"), "a list of");
    check_refused(folder.file("a.obj", "v 0 0\n"), "a.obj:1: expected 3 numbers, got 2");
    check_refused(folder.file("a.obj", "v 0 0 0\nf 1 2 3\n"), "refers to vertex 1");
    check_refused(folder.file("a.obj", "v 0 0 0\nf 1 -2 1\n"), "number of a vertex");
    check_refused(folder.file("a.obj", "v 0 0 0\n"), "no triangle");
    check_refused(folder.file("a.off", "OFF\n1000000000000 1 0\n0 0 0\n"), "a file of this size");
    check_refused(folder.file("a.off", "OFF\n1 1 0\n0 0 0\n4000000000 0 0 0\n"), "cannot fit into its line");
    check_refused(folder.file("a.off", "OFF\n3 1 0\n0 0 0\n1.5 0 0\n# padding\n"), "end of the file");
    check_refused(folder.file("a.stl", "abc"), "expected 84 bytes");
    check_refused(folder.file("a.stl", std::string(80, 'x') + "\xff\xff\xff\xff"), "4294967295 triangles");
    check_refused(folder.file("a.stl", "solid x\nvertex 1 2\n"), "a.stl:2");
}

TEST_CASE("Reading a file as a mesh or as points gives the same vertices and the same errors") {
    const Folder folder;
    const auto message_of = [](const auto& read) -> std::string {
        try {
            read();
        } catch (const Error& error) {
            const std::string message = error.what();
            return message.substr(message.find(':'));  // without the name of the function before it, which differs
        }
        return "was read";
    };
    const std::string vertex =
        "element vertex 3\nproperty float x\nproperty float Y\nproperty uchar red\nproperty double z\n";
    const std::string ply =
        "\n\nply\nformat ascii 1.0\n" + vertex + "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    const struct {
        const char* name;
        std::string text;
    } good[] = {{"a.ply", ply.substr(2) + "0 0 what 0\n\n1 0 9 0\n0 1 9 0\n3 0 1 2\n"},
                {"mac.obj", "v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r"},
                {"bom.off", "\xEF\xBB\xBFSTCNoff 3 1\n0 0 0 7\n1 0 0 7\n0 1 0 7\n3 0 1 2\n"}};
    for (const auto& file : good) {
        INFO(file.name);
        const std::string path = folder.file(file.name, file.text);
        CHECK(read_mesh(path).vertices == std::vector<std::array<float, 3>>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
        CHECK(read_points(path).points == std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    }
    const struct {
        const char* name;
        std::string text;
    } bad[] = {{"a.ply", ply},
               {"a.ply", ply.substr(2) + "0 0\n"},
               {"a.ply", ply.substr(2) + "0 0 0 0\n1 0 0 0\n0 1 0 nan\n3 0 1 2\n"},
               {"a.ply", ply.substr(2) + "0 0 0 0\n1 0 0 0\n0 1 0 0\n"},
               {"a.ply", "ply\n" + vertex + "end_header\n0 0 0 0\n1 0 0 0\n0 1 0 0\n"},
               {"a.obj", "v 0 0 0\nv 1 nan 0\n"},
               {"a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n"},
               {"a.off", "nOFF\n4\n1 0 0\n0 0 0 0\n"},
               {"a.off", "OFF BINARY\n"}};
    for (const auto& file : bad) {
        const std::string path = folder.file(file.name, file.text),
                          as_mesh = message_of([&] { (void)read_mesh(path); });
        INFO(as_mesh);
        CHECK(as_mesh != "was read");
        CHECK(message_of([&] { (void)read_points(path); }) == as_mesh);
    }
}

TEST_CASE("Mesh files with random damage are read with valid indices or rejected with an Error") {
    const Folder folder;
    std::mt19937 random(3);
    for (const char* end : {"ply", "obj", "off", "stl"})
        for (const bool binary : {true, false}) {
            WriteMeshOptions options;
            options.binary = binary;
            write_mesh(folder.file(std::string("good.") + end), tetrahedron(), options);
            const std::string good = text_of(folder.file(std::string("good.") + end));
            for (int round = 0; round < 100; ++round) {
                std::string bad = good.substr(0, round % 3 == 0 ? random() % good.size() : good.size());
                for (int i = 0; i < 1 + round % 5 && !bad.empty(); ++i) bad[random() % bad.size()] = char(random());
                try {
                    const TriangleMesh mesh = read_mesh(folder.file(std::string("bad.") + end, bad));
                    for (const auto& t : mesh.triangles)
                        for (const std::uint32_t v : t) REQUIRE(v < mesh.vertices.size());
                } catch (const Error&) {
                }
            }
        }
}

TEST_CASE("Unknown file extensions and invalid meshes are rejected before a file is created") {
    const Folder folder;
    CHECK_THROWS_AS(write_mesh(folder.file("a.xyz"), tetrahedron()), Error);
    CHECK_THROWS_AS(check_mesh_extension("a"), Error);
    CHECK_NOTHROW(check_mesh_extension("A.PLY"));
    TriangleMesh bad = tetrahedron();
    bad.triangles[0][0] = 9;
    CHECK_THROWS_AS(write_mesh(folder.file("a.ply"), bad), Error);
    CHECK_THROWS_AS(write_mesh(folder.file("no/such/a.ply"), tetrahedron()), Error);
    CHECK(fs::is_empty(folder.path));
}

TEST_CASE("Attributes are written as float properties of PLY vertices, and invalid ones are rejected") {
    const Folder folder;
    WriteMeshOptions options;
    options.attributes = {{"distance_to_marks", {0.5F, 1, 2, 3}}, {"edge_strength", {0, 0.25F, 0.5F, 1}}};
    for (const bool binary : {true, false}) {
        options.binary = binary;
        const std::string path = folder.file(binary ? "b.ply" : "a.ply");
        write_mesh(path, tetrahedron(), options);
        const std::string text = text_of(path);
        CHECK_THAT(text, Catch::Contains(
                             "property float nz\nproperty float distance_to_marks\nproperty float edge_strength\n"));
        const TriangleMesh back = read_mesh(path);
        CHECK(back.vertices == tetrahedron().vertices);
        CHECK(back.triangles == tetrahedron().triangles);
        if (!binary) continue;
        const std::size_t body = text.find("end_header\n") + 11;
        float value = 0;
        std::memcpy(&value, text.data() + body + 2 * 32 + 24, 4);
        CHECK(value == 2);
        std::memcpy(&value, text.data() + body + 1 * 32 + 28, 4);
        CHECK(value == 0.25F);
    }
    options.attributes[1].values.pop_back();
    CHECK_THROWS_WITH(write_mesh(folder.file("c.ply"), tetrahedron(), options), Catch::Contains("edge_strength"));
    options.attributes = {{"two words", {0, 0, 0, 0}}};
    CHECK_THROWS_AS(write_mesh(folder.file("c.ply"), tetrahedron(), options), Error);
    CHECK_FALSE(fs::exists(folder.file("c.ply")));
}

TEST_CASE("Several meshes are written to one OBJ or GLB file, each with its name") {
    const Folder folder;
    TriangleMesh second = tetrahedron();
    for (auto& v : second.vertices) v[0] += 10;
    const std::vector<NamedMesh> meshes{{"ve", tetrahedron(), {255, 0, 0}}, {"ex e", second, {0, 255, 0}}};

    const std::string obj = folder.file("s.obj");
    write_meshes(obj, meshes);
    CHECK_THAT(text_of(obj), Catch::Contains("o ve\n") && Catch::Contains("o ex e\n"));
    // Each corner names the normal of its vertex, and numbers continue from object to object.
    CHECK_THAT(text_of(obj), Catch::Contains("f 1//1 3//3 2//2\n") && Catch::Contains("f 5//5 7//7 6//6\n"));
    const TriangleMesh both = read_mesh(obj);
    REQUIRE(both.vertices.size() == 8);
    REQUIRE(both.triangles.size() == 8);
    CHECK(both.vertices[5] == second.vertices[1]);
    CHECK(both.triangles[4] == std::array<std::uint32_t, 3>{4, 6, 5});

    const std::string glb = folder.file("s.glb");
    write_meshes(glb, meshes);
    const std::string text = text_of(glb);
    std::uint32_t json_bytes = 0;
    std::memcpy(&json_bytes, text.data() + 12, 4);
    const std::string json = text.substr(20, json_bytes);
    CHECK_THAT(json, Catch::Contains(R"("name":"ve")") && Catch::Contains(R"("name":"ex e")"));
    CHECK_THAT(json, Catch::Contains(R"("nodes":[0,1])") && Catch::Contains(R"("baseColorFactor":[1.0,0.0,0.0,1.0])"));
    // Positions, normals and indices of both meshes, which have 4 vertices and 4 triangles each.
    CHECK(text.size() == 20 + json_bytes + 8 + 2 * (2 * 4 * 12 + 4 * 12));
    float x = 0;
    std::memcpy(&x, text.data() + 20 + json_bytes + 8 + (2 * 4 * 12 + 4 * 12), 4);
    CHECK(x == 10);

    const TriangleMesh again = read_mesh(glb);
    CHECK(again.vertices == both.vertices);
    CHECK(again.triangles == both.triangles);

    CHECK(holds_several_meshes("A.OBJ"));
    CHECK_FALSE(holds_several_meshes("a.ply"));
    CHECK_THROWS_AS(write_meshes(folder.file("s.ply"), meshes), Error);
    CHECK_THROWS_AS(write_meshes(obj, {}), Error);
}

namespace {

/// A .glb file with this JSON and binary chunk.
std::string glb_of(std::string json, std::string binary) {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    binary.resize((binary.size() + 3) / 4 * 4, '\0');
    const auto word = [](std::size_t value) {
        const auto number = std::uint32_t(value);
        return std::string(reinterpret_cast<const char*>(&number), 4);
    };
    return "glTF" + word(2) + word(28 + json.size() + binary.size()) + word(json.size()) + "JSON" + json +
           word(binary.size()) + std::string("BIN\0", 4) + binary;
}

template <typename T>
std::string raw(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::string replaced(std::string text, const std::string& what, const std::string& with) {
    REQUIRE(text.find(what) != std::string::npos);
    return text.replace(text.find(what), what.size(), with);
}

}  // namespace

TEST_CASE("GLB of other programs: interleaved and shared data is read, unsupported features are rejected") {
    const Folder folder;
    // Positions with a stride of 16 bytes, then two primitives with 16-bit indices that use the same positions. In
    // b.glb, the second primitive has no indices.
    const std::string binary = raw(std::vector<float>{0, 0, 0, 9, 1, 0, 0, 9, 0, 1, 0, 9, 0, 0, 1, 9}) +
                               raw(std::vector<std::uint16_t>{0, 2, 1, 0, 1, 3});
    const std::string json =
        R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":76}],)"
        R"("bufferViews":[{"buffer":0,"byteLength":64,"byteStride":16},{"buffer":0,"byteOffset":64,"byteLength":12}],)"
        R"("accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)"
        R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"},)"
        R"({"bufferView":1,"byteOffset":6,"componentType":5123,"count":3,"type":"SCALAR"},)"
        R"({"bufferView":0,"byteOffset":16,"componentType":5126,"count":3,"type":"VEC3"}],)"
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1},{"attributes":{"POSITION":0},"indices":2,"mode":4}]}],)"
        R"("nodes":[{"mesh":0}]})";
    const TriangleMesh mesh = read_mesh(folder.file("a.glb", glb_of(json, binary)));
    // The y axis points up in the file, the z axis in covol.
    CHECK(mesh.vertices == std::vector<std::array<float, 3>>{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {0, -1, 0}});
    CHECK(mesh.triangles == std::vector<std::array<std::uint32_t, 3>>{{0, 2, 1}, {0, 1, 3}});
    const TriangleMesh unindexed = read_mesh(
        folder.file("b.glb", glb_of(replaced(json, R"("POSITION":0},"indices":2)", R"("POSITION":3})"), binary)));
    REQUIRE(unindexed.vertices.size() == 7);
    CHECK(unindexed.triangles[1] == std::array<std::uint32_t, 3>{4, 5, 6});
    CHECK(unindexed.vertices[4] == std::array<float, 3>{1, 0, 0});

    const auto refused = [&](const std::string& what, const std::string& with, const std::string& wanted,
                             Errc code = Errc::InvalidInput) {
        check_refused(folder.file("c.glb", glb_of(replaced(json, what, with), binary)), wanted, code);
    };
    refused(R"("count":4)", R"("count":5)", "beyond its data");
    refused(R"("count":4)", R"("count":18446744073709551615)", "count: expected a whole number up to 65536");
    refused(R"("byteOffset":64)", R"("byteOffset":-1)", "byteOffset: expected a whole number up to 65536");
    refused(R"("byteStride":16)", R"("byteStride":0)", "beyond its data");
    refused(R"("count":4)", R"("count":2)", "refers to vertex 2 (counted from 0), but the number of vertices is 2");
    refused(R"("POSITION":0)", R"("POSITION":9)", "expected the number of one of its 4 accessors, from 0, got 9");
    refused(R"("mode":4)", R"("mode":1)", "not of triangles", Errc::Unsupported);
    refused(R"("mesh":0)", R"("mesh":0,"scale":[2,2,2])", "a node with a scale", Errc::Unsupported);
    refused(R"("mesh":0)", R"("mesh":0,"translation":[2,2])", "expected three numbers");
    refused(R"({"mesh":0})", R"({"mesh":0,"translation":[2,2,2]},{"mesh":0})", "elsewhere", Errc::Unsupported);
    refused(R"({"mesh":0})", R"({"mesh":1})", "expected the number of one of its 1 meshes, from 0, got 1");
    const TriangleMesh moved = read_mesh(
        folder.file("e.glb", glb_of(replaced(json, R"("mesh":0)", R"("mesh":0,"translation":[10,20,30])"), binary)));
    CHECK(moved.vertices[1] == std::array<float, 3>{11, -30, 20});
    CHECK(moved.origin == Vec3{0, 0, 0});
    refused(R"("nodes")", R"("extensionsRequired":["KHR_draco_mesh_compression"],"nodes")", "KHR_draco",
            Errc::Unsupported);
    refused(R"("byteLength":76)", R"("byteLength":76,"uri":"a.bin")", "another file", Errc::Unsupported);
    // Many primitives with the same indices: a small file must not make a large mesh.
    std::string many;
    for (int n = 0; n < 200; ++n) many += R"({"attributes":{"POSITION":0},"indices":1},)";
    refused(R"("primitives":[)", R"("primitives":[)" + many, "the same data too often");
    const std::string whole = glb_of(json, binary);
    for (std::size_t size = 0; size < whole.size(); ++size)
        CHECK_THROWS_AS(read_mesh(folder.file("d.glb", whole.substr(0, size))), Error);
    for (std::size_t at = 0; at < whole.size(); ++at)
        for (const int bit : {0, 3, 7}) {
            std::string flipped = whole;
            flipped[at] = char(flipped[at] ^ (1 << bit));
            try {
                (void)read_mesh(folder.file("d.glb", flipped));
            } catch (const Error&) {
            }
        }
}

TEST_CASE("Text STL: corners that differ by less than single precision become one vertex") {
    const Folder folder;
    const std::string facet = "facet normal 0 0 1\nouter loop\n", end = "endloop\nendfacet\n";
    const TriangleMesh mesh = read_mesh(
        folder.file("a.stl", "solid a\n" + facet + "vertex 1.00000001 0 0\nvertex 0 1 0\nvertex 0 0 0\n" + end + facet +
                                 "vertex 1.00000002 0 0\nvertex 0 0 0\nvertex 0 -1 0\n" + end + "endsolid a\n"));
    CHECK(mesh.vertices.size() == 4);
    check_refused(folder.file("b.obj", "v 1e300 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n"), "finite");
}

TEST_CASE("Meshes far from 0 keep their coordinates in every format, relative to an origin in binary STL",
          "[mesh_io]") {
    const Folder folder;
    TriangleMesh mesh = tetrahedron();
    mesh.origin = {500000, 5400000, -3000};
    std::vector<std::string> messages;
    WriteMeshOptions options;
    options.warn = [&](const std::string& line) { messages.push_back(line); };
    for (const char* name : {"a.ply", "a.obj", "a.off", "a.glb", "a.stl", "b.ply", "b.stl"}) {
        INFO(name);
        options.binary = name[0] == 'a';
        write_mesh(folder.file(name), mesh, options);
        const TriangleMesh again = read_mesh(folder.file(name));
        REQUIRE(again.vertices.size() == 4);
        const bool is_relative = std::string(name) == "a.stl";
        for (std::size_t v = 0; v < 4; ++v) {
            const Vec3 place = again.place(v);
            double nearest = 1;  // STL stores vertices in another order
            for (std::size_t other = 0; other < 4; ++other) {
                const Vec3 original = mesh.place(other);
                double apart = 0;
                for (int a = 0; a < 3; ++a)
                    apart = std::max(apart, std::abs(place[a] + (is_relative ? mesh.origin[a] : 0) - original[a]));
                nearest = std::min(nearest, apart);
            }
            CHECK(nearest < 1e-4);
        }
    }
    REQUIRE(messages.size() == 1);
    CHECK_THAT(messages.front(), Catch::Contains("relative to (500000, 5400000, -3000)"));
    // The mesh's origin is converted, too, if it is written in another unit and with y up.
    options = {};
    options.y_up = true;
    options.unit_scale = 0.001;
    write_mesh(folder.file("c.ply"), mesh, options);
    const TriangleMesh turned = read_mesh(folder.file("c.ply"));
    const Vec3 at = turned.place(2), expected{500, -3, -5400.0023};
    for (int a = 0; a < 3; ++a) CHECK(at[a] == Approx(expected[a]).margin(1e-4));
}
