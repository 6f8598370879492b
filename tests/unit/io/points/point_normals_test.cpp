// Tests of normals and sensor positions in files of points.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>

#include "covol/points.h"
#include "support/scratch.h"

using namespace covol;

namespace {

const Vec3 kNone{0, 0, 0};
const float kNan = std::numeric_limits<float>::quiet_NaN();

std::string floats(std::initializer_list<float> values) {
    std::string bytes;
    for (const float v : values) bytes.append(reinterpret_cast<const char*>(&v), sizeof(v));
    return bytes;
}

PointCloud read(const std::string& name, const std::string& content, const ReadPointsOptions& options = {}) {
    const Scratch scratch;
    return read_points(scratch.write(name, content), options);
}

void check_normal(const Vec3& found, const Vec3& expected) {
    for (int a = 0; a < 3; ++a) CHECK(found[a] == Approx(expected[a]).margin(1e-6));
}

std::string ply(const std::string& format, int count, const std::string& properties, const std::string& data) {
    return "ply\nformat " + format + " 1.0\nelement vertex " + std::to_string(count) + "\n" + properties +
           "end_header\n" + data;
}

const std::string kPosition = "property float x\nproperty float y\nproperty float z\n";
const std::string kNormal = "property float nx\nproperty float ny\nproperty float nz\n";

std::string pcd(const std::string& viewpoint, int width, int height, const std::string& rows) {
    return "VERSION 0.7\nFIELDS x y z normal_x normal_y normal_z\nSIZE 4 4 4 4 4 4\nTYPE F F F F F F\nCOUNT 1 1 1 1 1 "
           "1\nWIDTH " +
           std::to_string(width) + "\nHEIGHT " + std::to_string(height) + "\n" + viewpoint + "DATA ascii\n" + rows;
}

}  // namespace

TEST_CASE("PLY: normals have unit length, or are 0 if the file has no valid direction") {
    const std::string text = "0 0 0 0 0 2\n1 0 0 0 0 0\n2 0 0 nan 0 1\n3 0 0 3 0 4\n4 0 0 what 0 0\n";
    const std::string binary =
        floats({0, 0, 0, 0, 0, 2, 1, 0, 0, 0, 0, 0, 2, 0, 0, kNan, 0, 1, 3, 0, 0, 3, 0, 4, 4, 0, 0, 0, 0, 0});
    for (const PointCloud& cloud : {read("a.ply", ply("ascii", 5, kPosition + kNormal, text)),
                                    read("b.ply", ply("binary_little_endian", 5, kPosition + kNormal, binary))}) {
        REQUIRE(cloud.points.size() == 5);
        REQUIRE(cloud.normals.size() == 5);
        check_normal(cloud.normals[0], {0, 0, 1});
        CHECK(cloud.normals[1] == kNone);
        CHECK(cloud.normals[2] == kNone);
        check_normal(cloud.normals[3], {0.6, 0, 0.8});
        CHECK(cloud.normals[4] == kNone);
        CHECK(cloud.rule.find("with normals") != std::string::npos);
    }
}

TEST_CASE("PLY: incomplete normals are ignored, list properties are skipped, truncated data is rejected") {
    const PointCloud two =
        read("a.ply", ply("ascii", 1, kPosition + "property float nx\nproperty float nz\n", "0 0 0 1 1\n"));
    CHECK(two.normals.empty());
    const PointCloud shifted =
        read("b.ply", ply("ascii", 1, "property list uchar int ids\n" + kPosition + kNormal, "2 7 8 1 2 3 0 1 0\n"));
    CHECK(shifted.points.front() == Vec3{1, 2, 3});
    check_normal(shifted.normals.at(0), {0, 1, 0});
    const std::string cut = floats({0, 0, 0, 0, 0, 1, 1, 0, 0, 0});
    CHECK_THROWS_AS(read("c.ply", ply("binary_little_endian", 2, kPosition + kNormal, cut)), Error);
}

TEST_CASE("Normals follow the axis order and signs of their points, but not the scale") {
    const std::string text = ply("ascii", 1, kPosition + kNormal, "1 2 3 0.6 0 0.8\n");
    ReadPointsOptions options;
    options.scale = 10;
    options.space = PointSpace::Ras;
    check_normal(read("a.ply", text, options).normals.at(0), {-0.6, 0, 0.8});
    options.space = PointSpace::World;
    options.order = PointOrder::ZYX;
    check_normal(read("a.ply", text, options).normals.at(0), {0.8, 0, 0.6});
    options.space = PointSpace::Index;  // normals of points in voxels are no directions in the world
    CHECK(read("a.ply", text, options).normals.empty());
}

TEST_CASE("Columns: normals are found by name, or in six columns if the last three are unit vectors") {
    const PointCloud named = read("a.csv", "x,y,z,nx,ny,nz\n1,2,3,0,0,5\n4,5,6,,0,1\n");
    REQUIRE(named.normals.size() == 2);
    check_normal(named.normals[0], {0, 0, 1});
    check_normal(named.normals[1], {0, 0, 1});
    const PointCloud six = read("a.xyz", "0 0 0 0 0.6 -0.8\n1 0 0 0 0 0\n2 0 0 1 0 0\n");
    REQUIRE(six.normals.size() == 3);
    check_normal(six.normals[0], {0, 0.6, -0.8});
    CHECK(six.normals[1] == kNone);
    CHECK(read("b.xyz", "0 0 0 255 128 0\n1 0 0 255 255 255\n").normals.empty());  // colours
    CHECK(read("c.xyz", "0 0 0 0.2 0.5 0.1\n1 0 0 1 0 0\n").normals.empty());
    CHECK(read("d.xyz", "0 0 0 0 0 1 9\n1 0 0 0 0 1 9\n").normals.empty());  // seven columns are ambiguous
    CHECK(read("e.xyz", "0 0 0 0 0 1\n1 0 0\n").normals.at(1) == kNone);     // a short row has none
}

TEST_CASE("OBJ: normals are read only if each vertex has the normal of its own number") {
    const std::string vertices = "v 0 0 0\nvn 0 0 2\nv 1 0 0\nvn 0 3 0\nv 0 1 0\nvn 1 0 0\n";
    const PointCloud cloud = read("a.obj", vertices + "f 1//1 2//2 3//3\n");
    REQUIRE(cloud.normals.size() == 3);
    check_normal(cloud.normals[1], {0, 1, 0});
    CHECK(read("b.obj", vertices + "f 1//1 2//3 3//2\n").normals.empty());
    CHECK(read("c.obj", vertices + "vn 0 0 1\n").normals.empty());
    // The second number in "1/4" is that of a texture coordinate, not of a normal.
    CHECK(read("d.obj", vertices + "f 1/4 2/5 3/6\n").normals.size() == 3);
}

TEST_CASE("PCD: normals stay with their points if invalid points are omitted, and the sensor is read") {
    const std::string rows = "nan nan nan 1 0 0\n1 0 0 0 1 0\n2 0 0 nan nan nan\n3 0 0 0 0 1\n";
    const PointCloud cloud = read("a.pcd", pcd("VIEWPOINT 1 2 3 1 0 0 0\n", 4, 1, rows));
    REQUIRE(cloud.points.size() == 3);
    REQUIRE(cloud.normals.size() == 3);
    check_normal(cloud.normals[0], {0, 1, 0});
    CHECK(cloud.normals[1] == kNone);
    check_normal(cloud.normals[2], {0, 0, 1});
    REQUIRE(cloud.sensor);
    CHECK(*cloud.sensor == Vec3{1, 2, 3});
    // Programs that do not know the viewpoint write this default, so it is no sensor. In an organized cloud (rows of
    // pixels) it is the position of the camera.
    CHECK_FALSE(read("b.pcd", pcd("VIEWPOINT 0 0 0 1 0 0 0\n", 4, 1, rows)).sensor);
    CHECK(read("c.pcd", pcd("VIEWPOINT 0 0 0 1 0 0 0\n", 2, 2, rows)).sensor == std::optional(Vec3{0, 0, 0}));
    CHECK_FALSE(read("d.pcd", pcd("", 2, 2, rows)).sensor);
    CHECK_THROWS_AS(read("e.pcd", pcd("VIEWPOINT nan 0 0 1 0 0 0\n", 4, 1, rows)), Error);
    ReadPointsOptions options;
    options.scale = 2;
    CHECK(read("f.pcd", pcd("VIEWPOINT 1 2 3 1 0 0 0\n", 4, 1, rows), options).sensor == std::optional(Vec3{2, 4, 6}));
}
