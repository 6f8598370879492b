#include "covol/points.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "covol/mark_kinds.h"
#include "covol/point_structures.h"
#include "covol/program_marks.h"
#include "support/scratch.h"

using namespace covol;

namespace {

const std::vector<Vec3> kThree{{1, 2, 3}, {-4.5, 0.25, 1e-3}, {7, 8, 9}};

std::vector<Vec3> random_points(std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<Vec3> points(count);
    for (Vec3& p : points)
        for (double& x : p) x = double(random()) / 4294967296.0;
    return points;
}

template <typename T>
std::string bytes(T value, bool big_endian) {
    std::string text(sizeof(T), '\0');
    std::memcpy(text.data(), &value, sizeof(T));
    if (big_endian) std::reverse(text.begin(), text.end());
    return text;
}

/// A PLY file that is difficult to read: an element with a list precedes the vertices, whose coordinates z, x, y follow
/// a colour, have different types and are separated by a list.
std::string awkward_ply(const std::string& format) {
    const bool ascii = format == "ascii";
    const bool big = format == "binary_big_endian";
    std::string text = "ply\nformat " + format +
                       " 1.0\ncomment made by hand\n"
                       "element camera 2\nproperty list uchar int ids\nproperty float f\n"
                       "element vertex 3\nproperty uchar red\nproperty double z\nproperty list uchar short tags\n"
                       "property float x\nproperty double y\n"
                       "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    if (ascii) {
        text += "2 10 20 0.5\n0 0.5\n";
        for (const Vec3& p : kThree)
            text +=
                "255 " + std::to_string(p[2]) + " 2 7 8 " + std::to_string(p[0]) + " " + std::to_string(p[1]) + "\n";
        return text + "3 0 1 2\n";
    }
    text += bytes<std::uint8_t>(2, big) + bytes<std::int32_t>(10, big) + bytes<std::int32_t>(20, big) +
            bytes(0.5F, big) + bytes<std::uint8_t>(0, big) + bytes(0.5F, big);
    for (const Vec3& p : kThree)
        text += bytes<std::uint8_t>(255, big) + bytes(p[2], big) + bytes<std::uint8_t>(2, big) +
                bytes<std::int16_t>(7, big) + bytes<std::int16_t>(8, big) + bytes(static_cast<float>(p[0]), big) +
                bytes(p[1], big);
    return text + bytes<std::uint8_t>(3, big) + bytes<std::int32_t>(0, big) + bytes<std::int32_t>(1, big) +
           bytes<std::int32_t>(2, big);
}

std::string read_error(const Scratch& scratch, const std::string& name, const std::string& content) {
    const std::string path = scratch.write(name, content);
    return message_of([&] { (void)read_points(path); });
}

}  // namespace

TEST_CASE("XYZ, CSV and TSV are read with common headers, separators, decimal commas and line ends") {
    const Scratch scratch;
    const struct {
        const char* name;
        const char* content;
    } files[] = {
        {"a.xyz", "1 2 3\n-4.5 0.25 1e-3\n7 8 9\n"},
        {"b.xyz", "# marks\n\n  1\t2  3 0 0 1\r\n-4.5 +0.25 1E-3 # seen\r\n7 8 9"},
        {"c.xyz", "x y z\n1 2 3\n-4.5 .25 0.001\n7 8 9\n"},
        {"d.pts", "3\n1 2 3\n-4.5 .25 0.001\n7 8 9\n"},
        {"a.csv", "1,2,3\n-4.5,0.25,0.001\n7,8,9\n"},
        {"b.csv", "\xEF\xBB\xBFid,Z,Y,X\n0,3,2,1\n1,0.001,0.25,-4.5\n2,9,8,7\n"},
        {"c.csv",
         "\"name, short\",\"X (microns)\",\"Y (microns)\",\"Z (microns)\"\n\"a,b\",1,2,3\nb,-4.5,0.25,0.001\nc, 7 , 8 "
         ", 9\n"},
        {"d.csv", "x;y;z\n1;2;3\n-4,5;0,25;0,001\n7;8;9\n"},
        {"e.tsv", " \tArea\tX\tY\tZ\n\t0\t1\t2\t3\n2\t0\t-4.5\t0.25\t0.001\n3\t0\t7\t8\t9\n"},
        {"f.csv", "1 2 3\n-4.5 0.25 0.001\n7 8 9\n"},
        {"mac.xyz", "1 2 3\r-4.5 .25 .001\r7 8 9\r"},
    };
    for (const auto& file : files) {
        INFO(file.name);
        const PointCloud cloud = read_points(scratch.write(file.name, file.content));
        CHECK(cloud.points == kThree);
        CHECK(cloud.space == PointSpace::World);
    }
}

TEST_CASE("Column names that denote voxels select voxel coordinates, and the options take precedence") {
    const Scratch scratch;
    const std::string napari =
        scratch.write("napari.csv", "index,axis-0,axis-1,axis-2\n0,3,2,1\n1,0.001,0.25,-4.5\n2,9,8,7\n");
    PointCloud cloud = read_points(napari);
    CHECK(cloud.points == kThree);
    CHECK(cloud.space == PointSpace::Index);
    CHECK(cloud.rule.find("napari") != std::string::npos);
    // The options take precedence over the column names.
    cloud = read_points(napari, {PointSpace::World, PointOrder::XYZ});
    CHECK(cloud.space == PointSpace::World);
    CHECK(cloud.points[0] == Vec3{3, 2, 1});

    cloud = read_points(scratch.write("clicks.csv", "slice,contour,x_px,y_px\n3,0,1,2\n"));
    CHECK(cloud.points[0] == Vec3{1, 2, 3});
    CHECK(cloud.space == PointSpace::Index);
}

TEST_CASE("The length unit in column names is the unit of the cloud, unless a scale is given") {
    const Scratch scratch;
    const std::string table = scratch.write("lengths.csv", "x (um),y (um),z (um)\n1,2,3\n");
    const PointCloud cloud = read_points(table);
    CHECK(cloud.unit == "um");
    CHECK(cloud.rule.ends_with("lengths in um"));
    ImageGeometry in_mm;
    in_mm.unit = "mm";
    CHECK(to_world(cloud, in_mm)[0][1] == Approx(0.002));
    ReadPointsOptions given;
    given.scale = 10;
    CHECK(read_points(table, given).unit.empty());
    CHECK(to_world(read_points(table, given), in_mm)[0][1] == Approx(20));
    CHECK(read_points(scratch.write("voxels.csv", "x_px,y_px,slice\n1,2,3\n")).unit.empty());
}

TEST_CASE("A column of kinds separates surface, inside and outside marks, and other words are ignored") {
    const Scratch scratch;
    const std::vector<MarkKind> kinds{MarkKind::Surface, MarkKind::Inside, MarkKind::Outside};
    const std::string table = "structure,kind,x,y,z\na,surface,1,2,3\na, Inside ,-4.5,0.25,0.001\na,outside,7,8,9\n";
    const KindedPoints marks = read_kinded_points(scratch.write("marks.csv", table));
    CHECK(marks.cloud.points == kThree);
    CHECK(marks.kinds == kinds);
    CHECK(marks.cloud.rule.find("with kinds") != std::string::npos);
    CHECK(marks.of(MarkKind::Surface).points == std::vector<Vec3>{{1, 2, 3}});
    CHECK(marks.of(MarkKind::Outside).points == std::vector<Vec3>{{7, 8, 9}});
    // If the column `kind` contains another word in any row, or if a row lacks it, it is from another program. All
    // points then are surface marks.
    for (const char* rows : {"x,y,z,kind\n1,2,3,soma\n-4.5,.25,.001,inside\n7,8,9,axon\n",
                             "x,y,z,kind\n1,2,3,inside\n-4.5,.25,.001,5\n7,8,9,inside\n",
                             "x,y,z,kind\n1,2,3,inside\n-4.5,.25,.001\n7,8,9,inside\n"}) {
        const KindedPoints other = read_kinded_points(scratch.write("other.csv", rows));
        CHECK(other.of(MarkKind::Surface).points == kThree);
        CHECK(other.of(MarkKind::Inside).points.empty());
        CHECK(other.kinds.empty());
    }
}

TEST_CASE("Marks of several structures keep their kinds, and more than 254 structures are rejected") {
    const Scratch scratch;
    const std::string table =
        "structure,kind,x,y,z\na,surface,1,2,3\nb,inside,4,5,6\na,outside,7,8,9\nb,surface,3,2,1\n";
    const auto found = read_structures_of_points(scratch.write("marks.csv", table), "structure");
    REQUIRE(found.size() == 2);
    CHECK(found[0].name == "a");
    CHECK(found[0].points.of(MarkKind::Surface).points == std::vector<Vec3>{{1, 2, 3}});
    CHECK(found[0].points.of(MarkKind::Outside).points == std::vector<Vec3>{{7, 8, 9}});
    CHECK(found[1].points.of(MarkKind::Inside).points == std::vector<Vec3>{{4, 5, 6}});
    CHECK(found[1].points.of(MarkKind::Surface).points == std::vector<Vec3>{{3, 2, 1}});

    std::string many = "x,y,z,cell\n";
    for (int n = 0; n < 255; ++n) many += "1,2," + std::to_string(n) + ",cell " + std::to_string(n) + "\n";
    const std::string path = scratch.write("many.csv", many);
    CHECK_THROWS_WITH(read_structures_of_points(path, "cell"), Catch::Contains("at most 254"));
}

TEST_CASE("Writing marks: Fiji ROIs beyond 32766 pixels and unknown extensions are rejected") {
    const Scratch scratch;
    const ImageGeometry image;
    write_program_marks(scratch.path("near.roi"), {{{32000, 3, 1}, "a"}}, image);
    CHECK_THROWS_WITH(write_program_marks(scratch.path("far.roi"), {{{40000, 3, 1}, "a"}}, image),
                      Catch::Contains("32766"));
    CHECK_THROWS_WITH(write_program_marks(scratch.path("far.txt"), {}, image), Catch::Contains(".mrk.json"));
}

TEST_CASE("Columns slice and contour are read as ordered, closed lines") {
    const Scratch scratch;
    // The rows contain contour 0 of slices 3 and 4, and contour 1 of slice 3. The last row is out of order.
    const PointCloud cloud = read_points(scratch.write(
        "contours.csv", "slice,contour,x_px,y_px\n3,0,1,2\n3,0,4,2.5\n3,1,9,9\n4,0,7,7\n4,0,8,7\n3,0,4,6\n"));
    CHECK(cloud.space == PointSpace::Index);
    CHECK(cloud.points == std::vector<Vec3>{{1, 2, 3}, {4, 2.5, 3}, {4, 6, 3}, {9, 9, 3}, {7, 7, 4}, {8, 7, 4}});
    REQUIRE(cloud.lines.size() == 3);
    const std::size_t ends[] = {3, 4, 6};
    for (std::size_t n = 0; n < 3; ++n) {
        CHECK(cloud.lines[n].begin == (n == 0 ? 0 : ends[n - 1]));
        CHECK(cloud.lines[n].end == ends[n]);
        CHECK(cloud.lines[n].closed);
    }
    CHECK(cloud.lines[1].name == "1");
    CHECK(cloud.rule.find("lines by slice and contour") != std::string::npos);
}

TEST_CASE("napari shapes are read as lines that are closed or open according to their type") {
    const Scratch scratch;
    const PointCloud cloud = read_points(
        scratch.write("shapes.csv",
                      "index,shape-type,vertex-index,axis-0,axis-1,axis-2\n"
                      "0.0,polygon,0.0,5.0,2.0,1.0\n0.0,polygon,2.0,5.0,6.0,4.0\n0.0,polygon,1.0,5.0,2.0,4.0\n"
                      "1.0,path,0.0,6.0,2.0,1.0\n1.0,path,1.0,6.0,2.0,4.0\n1.0,path,2.0,6.0,9.0,4.0\n"
                      "2.0,line,0.0,7.0,2.0,1.0\n2.0,line,1.0,7.0,2.0,4.0\n"
                      "3.0,rectangle,0.0,8.0,2.0,1.0\n3.0,rectangle,1.0,8.0,2.0,4.0\n3.0,rectangle,2.0,8.0,9.0,4.0\n"
                      "3.0,rectangle,3.0,8.0,9.0,1.0\n"
                      "4.0,ellipse,0.0,9.0,10.0,20.0\n4.0,ellipse,1.0,9.0,10.0,40.0\n"
                      "4.0,ellipse,2.0,9.0,16.0,40.0\n4.0,ellipse,3.0,9.0,16.0,20.0\n"));
    CHECK(cloud.space == PointSpace::Index);
    REQUIRE(cloud.lines.size() == 5);
    CHECK(cloud.points[0] == Vec3{1, 2, 5});
    CHECK(cloud.points[1] == Vec3{4, 2, 5});  // in the order of the column vertex-index
    CHECK(cloud.points[2] == Vec3{4, 6, 5});
    const bool closed[] = {true, false, false, true, true};
    for (std::size_t n = 0; n < 5; ++n) CHECK(cloud.lines[n].closed == closed[n]);
    // The ellipse in the file: x = 30 +- 10, y = 13 +- 3.
    const MarkLine& ellipse = cloud.lines[4];
    CHECK(ellipse.end - ellipse.begin >= 40);
    for (std::size_t n = ellipse.begin; n < ellipse.end; ++n) {
        const Vec3& p = cloud.points[n];
        CHECK(p[2] == 9);
        CHECK(std::pow((p[0] - 30) / 10, 2) + std::pow((p[1] - 13) / 3, 2) == Approx(1));
    }
    CHECK(read_error(scratch, "bad.csv", "index,shape-type,vertex-index,axis-0,axis-1,axis-2\n0,ellipse,0,1,2,3\n")
              .find("expected the 4 corners of an ellipse") != std::string::npos);
}

TEST_CASE("PLY points are read in ASCII and both byte orders, among other elements and properties") {
    const Scratch scratch;
    for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
        INFO(format);
        const PointCloud cloud = read_points(scratch.write("awkward.ply", awkward_ply(format)));
        REQUIRE(cloud.points.size() == 3);
        for (std::size_t n = 0; n < 3; ++n)
            for (int a = 0; a < 3; ++a) CHECK(cloud.points[n][a] == Approx(kThree[n][a]));
    }
}

TEST_CASE("OBJ and OFF: the vertices are read as points") {
    const Scratch scratch;
    const std::string obj =
        "# cube\nmtllib a.mtl\nv 1 2 3\nvn 0 0 1\nv -4.5 0.25 0.001 0.5 0.5 0.5\nvt 0 0\nv 7 8 9\nf 1 2 3\n";
    CHECK(read_points(scratch.write("a.obj", obj)).points == kThree);
    CHECK(read_points(scratch.write("a.off", "OFF\n# c\n3 1 0\n1 2 3\n-4.5 0.25 0.001\n\n7 8 9\n3 0 1 2\n")).points ==
          kThree);
    CHECK(read_points(scratch.write("b.off", "COFF 3 0 0\n1 2 3 9 9 9 9\n-4.5 0.25 0.001 1 1 1 1\n7 8 9 0 0 0 0\n"))
              .points == kThree);
}

TEST_CASE("Errors of point files state the file, the line, what was expected and what was found") {
    const Scratch scratch;
    const auto contains = [](const std::string& message, const std::string& part) {
        INFO(message);
        CHECK(message.find(part) != std::string::npos);
        CHECK(message.find('\n') == std::string::npos);
    };
    contains(read_error(scratch, "a.xyz", "1 2 3\n1 2\n"), "a.xyz:2: expected 3 numbers, got 2");
    contains(read_error(scratch, "a.xyz", "1 2 3\n1 2 three\n"), "a.xyz:2: expected a number, got 'three'");
    contains(read_error(scratch, "a.xyz", "1 2 3\n\n1 nan 3\n"), "a.xyz:3: expected a finite number, got 'nan'");
    contains(read_error(scratch, "a.xyz", "1 2 inf\n"), "a.xyz:1: expected a finite number");
    contains(read_error(scratch, "a.xyz", "the quick brown fox\n"), "a.xyz:1: expected columns named x, y, z");
    contains(read_error(scratch, "a.xyz", ""), "the file is empty");
    contains(read_error(scratch, "a.xyz", "# nothing\n"), "expected at least one point, got none");
    contains(read_error(scratch, "a.csv", "a,b,c\n1,2,3\n"), "a.csv:1: expected columns named x, y, z");
    contains(read_error(scratch, "a.csv", "x,y,z\n1,2\n"), "a.csv:2: expected 3 numbers, got 2");
    contains(read_error(scratch, "a.csv", "id,x,y,z\n1,2,3\n"), "a.csv:2: expected 4 columns, got 3");
    contains(read_error(scratch, "a.obj", "v 1 2\n"), "a.obj:1: expected 3 numbers, got 2");
    contains(read_error(scratch, "a.obj", "hello\n"), "expected at least one point");
    contains(read_error(scratch, "a.off", "OFF\n2 0 0\n1 2 3\n"), "got 1; the file is truncated");
    contains(read_error(scratch, "a.off", "OFF\n1e15 0 0\n1 2 3\n"), "cannot contain '1e15' vertices");
    contains(read_error(scratch, "a.ply", "plot\n"), "expected 'ply'");
    contains(read_error(scratch, "a.ply",
                        "ply\nformat ascii 1.0\nelement vertex 99999999999\nproperty float x\n"
                        "property float y\nproperty float z\nend_header\n0 0 0\n"),
             "truncated");
    contains(read_error(scratch, "a.ply",
                        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                        "end_header\n0 0\n"),
             "expected a vertex property 'z'");
    contains(read_error(scratch, "a.ply",
                        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                        "property float z\nend_header\n0 0 zero\n"),
             "a.ply:8: expected a number");
    contains(read_error(scratch, "a.doc", "1 2 3\n"), "expected a name ending in one of");
    contains(message_of([&] { (void)read_points(scratch.path("none.xyz")); }), "no such file");
    contains(message_of([&] { (void)read_points(scratch.path("")); }), "expected a name");

    const double nan = std::numeric_limits<double>::quiet_NaN();
    const std::string header =
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty double x\n"
        "property double y\nproperty double z\nend_header\n";
    contains(read_error(scratch, "n.ply", header + bytes(1.0, false) + bytes(nan, false) + bytes(1.0, false)),
             "vertex 0: expected finite numbers");
}

TEST_CASE("A PLY with truncated faces is rejected, although all its vertices are present") {
    const Scratch scratch;
    const auto is_cut_off = [&](const std::string& whole, std::size_t missing) {
        return read_error(scratch, "a.ply", whole.substr(0, whole.size() - missing)).find("truncated") !=
               std::string::npos;
    };
    const std::string ascii =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 2 1 0\n";
    CHECK(read_points(scratch.write("whole.ply", ascii)).points.size() == 3);
    for (const std::size_t missing : {3, 5, 8, 10, 16}) CHECK(is_cut_off(ascii, missing));
    std::string binary =
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
    binary += bytes(1.0F, false) + bytes(2.0F, false) + bytes(3.0F, false);
    for (int face = 0; face < 2; ++face) binary += '\3' + std::string(12, '\0');
    CHECK(read_points(scratch.write("whole.ply", binary)).points.size() == 1);
    for (std::size_t missing = 1; missing <= 26; ++missing) CHECK(is_cut_off(binary, missing));
}

TEST_CASE("Damaged PLY, OFF, CSV and OBJ point files never crash the reader") {
    const Scratch scratch;
    const auto read = [](const std::string& path) { (void)read_points(path); };
    for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
        const std::string good = scratch.write("good.ply", awkward_ply(format));
        fuzz(scratch, good, read);
    }
    fuzz(scratch, scratch.write("good.off", "OFF\n3 1 0\n1 2 3\n4 5 6\n7 8 9\n3 0 1 2\n"), read);
    fuzz(scratch, scratch.write("good.csv", "x,y,z\n1,2,3\n4,5,6\n"), read);
    fuzz(scratch, scratch.write("good.obj", "v 1 2 3\nv 4 5 6\n"), read);

    const std::string vertices = scratch.path("vertices.ply");
    write_points(vertices, random_points(50, 1));
    CHECK(fuzz(scratch, vertices, read).truncated_accepted == 0);
}

TEST_CASE("Points are written and read back bit for bit") {
    const Scratch scratch;
    const std::vector<Vec3> points = random_points(200, 2);
    for (const char* name : {"p.xyz", "p.csv", "p.ply"}) {
        INFO(name);
        write_points(scratch.path(name), points, "made by a test\nin two lines");
        CHECK(read_points(scratch.path(name)).points == points);
    }
    CHECK(scratch.file_count() == 3);
    CHECK_THROWS_AS(write_points(scratch.path("p.stl"), points), Error);
}

TEST_CASE("Voxel coordinates are converted by the image's geometry, and rejected without an image") {
    ImageGeometry geometry;
    geometry.size = {10, 10, 10};
    geometry.spacing = {0.5, 0.5, 2};
    geometry.origin = {100, 200, 300};
    PointCloud cloud;
    cloud.points = {{2, 4, 1}};
    CHECK(to_world(cloud)[0] == Vec3{2, 4, 1});
    cloud.space = PointSpace::Index;
    CHECK(to_world(cloud, geometry)[0] == Vec3{101, 202, 302});
    CHECK_THROWS_AS(to_world(cloud), Error);
}

TEST_CASE("Close points are merged into the first of them, and the order is preserved") {
    const std::vector<Vec3> points{{0.9, 0, 0}, {0.1, 0, 0}, {0.9, 0, 0}, {0.12, 0, 0}, {1.1, 0, 0}, {0.6, 0, 0}};
    CHECK(merge_close_points(points, 0) ==
          std::vector<Vec3>{{0.9, 0, 0}, {0.1, 0, 0}, {0.12, 0, 0}, {1.1, 0, 0}, {0.6, 0, 0}});
    // 0.12 is too close to 0.1, and 0.6 to 0.9, so they are left out. 1.1 is in the cell after that of 0.9.
    CHECK(merge_close_points(points, 1.0) == std::vector<Vec3>{{0.9, 0, 0}, {0.1, 0, 0}, {1.1, 0, 0}});
    CHECK(merge_close_points({}, 1.0).empty());
    CHECK_THROWS_AS(merge_close_points(points, -1.0), Error);

    const std::vector<Vec3> many = random_points(5000, 3);
    const std::vector<Vec3> merged = merge_close_points(many, 0.1);
    CHECK(merged.size() < many.size());
    for (std::size_t a = 0; a < merged.size(); ++a)
        for (std::size_t b = a + 1; b < merged.size(); ++b) {
            bool same_cell = true;
            double distance = 0;
            for (int c = 0; c < 3; ++c) {
                same_cell = same_cell && std::floor(merged[a][c] / 0.1) == std::floor(merged[b][c] / 0.1);
                distance += (merged[a][c] - merged[b][c]) * (merged[a][c] - merged[b][c]);
            }
            if (same_cell && distance < 0.05 * 0.05) FAIL("two points of one cell are closer than half its edge");
        }
}

TEST_CASE("Spatial order: neighbours follow each other, and thinning keeps the same fraction everywhere") {
    std::vector<Vec3> points = random_points(20000, 7);
    for (Vec3& p : points) p[0] *= p[0];  // denser on one side
    std::vector<std::uint32_t> order = order_spatially(points, points.size());
    const auto path = [&](const std::vector<std::uint32_t>& along) {
        double length = 0;
        for (std::size_t n = 1; n < along.size(); ++n) {
            const Vec3 &p = points[along[n - 1]], &q = points[along[n]];
            length += std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
        }
        return length;
    };
    std::vector<std::uint32_t> all(points.size());
    for (std::size_t n = 0; n < all.size(); ++n) all[n] = std::uint32_t(n);
    CHECK(path(order) < 0.12 * path(all));
    CHECK(order_spatially(points, 1000000) == order);
    const std::vector<std::uint32_t> some = order_spatially(points, 3000);
    REQUIRE(some.size() == 3000);
    for (int octant = 0; octant < 8; ++octant) {
        const auto is_in = [&](std::uint32_t n) {
            return (points[n][0] > 0.5) == bool(octant & 1) && (points[n][1] > 0.5) == bool(octant & 2) &&
                   (points[n][2] > 0.5) == bool(octant & 4);
        };
        const double before = double(std::count_if(all.begin(), all.end(), is_in)),
                     after = double(std::count_if(some.begin(), some.end(), is_in));
        // If points were selected at random, the standard deviation of this fraction would be at least 0.005.
        CHECK(after / before == Approx(0.15).margin(0.003));
    }
    std::sort(order.begin(), order.end());
    CHECK(order == all);
    CHECK(order_spatially({}, 5).empty());
    CHECK(order_spatially(std::vector<Vec3>(10, Vec3{1, 2, 3}), 4).size() == 4);
    CHECK_THROWS_AS(order_spatially(points, 0), Error);
}

TEST_CASE("Spacing statistics are exact for a lattice, and equal brute force for clusters") {
    std::vector<Vec3> lattice;
    for (int i = 0; i < 12; ++i)
        for (int j = 0; j < 12; ++j)
            for (int k = 0; k < 12; ++k) lattice.push_back({0.5 * i, 0.5 * j, 0.5 * k});
    SpacingStatistics s = measure_spacing(lattice);
    CHECK(s.mean == Approx(0.5));
    CHECK(s.max == Approx(0.5));

    // Clusters of very different sizes, far from the origin.
    std::vector<Vec3> points = random_points(1000, 4);
    for (std::size_t n = 0; n < points.size(); ++n) {
        const double scale = n % 2 == 0 ? 1e-4 : 50.0;
        for (double& x : points[n]) x = 1e3 + scale * x;
    }
    std::vector<double> exact;
    for (std::size_t a = 0; a < points.size(); ++a) {
        double best = 1e30;
        for (std::size_t b = 0; b < points.size(); ++b)
            if (a != b)
                best = std::min(best, std::hypot(points[a][0] - points[b][0], points[a][1] - points[b][1],
                                                 points[a][2] - points[b][2]));
        exact.push_back(best);
    }
    std::sort(exact.begin(), exact.end());
    s = measure_spacing(points);
    double sum = 0;
    for (const double d : exact) sum += d;
    CHECK(s.mean == Approx(sum / 1000));
    CHECK(s.max == Approx(exact.back()));
    CHECK(s.p95 == Approx(exact[949]));
    CHECK(measure_spacing({{1, 2, 3}}).mean == 0);
}
