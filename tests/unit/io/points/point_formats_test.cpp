#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "covol/points.h"
#include "support/deflated.h"
#include "support/scratch.h"
#include "unit/io/points/program_files.h"

// Each format, byte by byte according to its specification.

using namespace covol;
using namespace covol::test;

namespace {

std::string zip(const std::vector<std::pair<std::string, std::string>>& files, bool deflate = true) {
    Writer w(false), directory(false);
    for (const auto& [name, content] : files) {
        const std::string packed = deflate ? test::deflated(content, -MAX_WBITS) : content;
        const auto crc = std::uint32_t(crc32(0, reinterpret_cast<const Bytef*>(content.data()), uInt(content.size())));
        directory.put(std::uint32_t(0x02014b50)).put(std::uint16_t(20)).put(std::uint16_t(20)).put(std::uint16_t(0));
        directory.put(std::uint16_t(deflate ? 8 : 0)).put(std::uint32_t(0)).put(crc).put(std::uint32_t(packed.size()));
        directory.put(std::uint32_t(content.size()))
            .put(std::uint16_t(name.size()))
            .put(std::uint16_t(0))
            .put(std::uint16_t(0));
        directory.put(std::uint16_t(0))
            .put(std::uint16_t(0))
            .put(std::uint32_t(0))
            .put(std::uint32_t(w.size()))
            .put(name);
        // As in archives that Java writes (bit 3 of the flags), the sizes here are 0; the true ones follow the data and
        // are in the archive's directory.
        w.put(std::uint32_t(0x04034b50))
            .put(std::uint16_t(20))
            .put(std::uint16_t(8))
            .put(std::uint16_t(deflate ? 8 : 0));
        w.put(std::uint32_t(0)).put(std::uint32_t(0)).put(std::uint32_t(0)).put(std::uint32_t(0));
        w.put(std::uint16_t(name.size())).put(std::uint16_t(0)).put(name).put(packed);
        w.put(std::uint32_t(0x08074b50)).put(crc).put(std::uint32_t(packed.size())).put(std::uint32_t(content.size()));
    }
    const std::size_t begin = w.size();
    w.put(directory.text()).put(std::uint32_t(0x06054b50)).put(std::uint32_t(0)).put(std::uint16_t(files.size()));
    w.put(std::uint16_t(files.size()))
        .put(std::uint32_t(directory.size()))
        .put(std::uint32_t(begin))
        .put(std::uint16_t(0));
    return w.text();
}

// ---- scans

/// Packs bytes in the format LZF. This is greedy and slow; a match may overlap the bytes that it produces.
std::string lzf(const std::string& in) {
    std::string out, literals;
    const auto flush = [&] {
        for (std::size_t at = 0; at < literals.size(); at += 32) {
            const std::string run = literals.substr(at, 32);
            out += char(run.size() - 1);
            out += run;
        }
        literals.clear();
    };
    for (std::size_t at = 0; at < in.size();) {
        std::size_t best = 0, back = 0;
        for (std::size_t from = at > 8192 ? at - 8192 : 0; from < at; ++from) {
            std::size_t length = 0;
            while (length < 264 && at + length < in.size() && in[from + length] == in[at + length]) ++length;
            if (length > best) best = length, back = at - from - 1;
        }
        if (best < 3) {
            literals += in[at++];
            continue;
        }
        flush();
        const std::size_t count = best - 2;
        out += char((count < 7 ? count << 5 : 7 << 5) | back >> 8);
        if (count >= 7) out += char(count - 7);
        out += char(back & 255);
        at += best;
    }
    flush();
    return out;
}

std::string pcd(const std::vector<Vec3>& points, const std::string& data) {
    std::string text =
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS intensity x y z tag\nSIZE 2 4 8 4 1\n"
        "TYPE U F F F U\nCOUNT 1 1 1 1 3\nWIDTH " +
        std::to_string(points.size()) + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + std::to_string(points.size()) +
        "\nDATA " + data + "\n";
    if (data == "ascii") {
        for (const Vec3& p : points)
            text += "7 " + std::to_string(p[0]) + " " + std::to_string(p[1]) + " " + std::to_string(p[2]) + " 1 2 3\n";
        return text;
    }
    Writer w(false);
    if (data == "binary") {
        for (const Vec3& p : points)
            w.put(std::uint16_t(7)).put(float(p[0])).put(p[1]).put(float(p[2])).put(std::string("abc"));
        return text + w.text();
    }
    for (std::size_t n = 0; n < points.size(); ++n) w.put(std::uint16_t(7));
    for (const Vec3& p : points) w.put(float(p[0]));
    for (const Vec3& p : points) w.put(p[1]);
    for (const Vec3& p : points) w.put(float(p[2]));
    for (std::size_t n = 0; n < points.size(); ++n) w.put(std::string("abc"));
    const std::string packed = lzf(w.text());
    Writer sizes(false);
    sizes.put(std::uint32_t(packed.size())).put(std::uint32_t(w.size()));
    return text + sizes.text() + packed;
}

std::string las(const std::vector<Vec3>& points, int minor, std::uint8_t format = 1) {
    const std::uint16_t header = minor == 4 ? 375 : minor == 3 ? 235 : 227, stride = 28;
    const double scale = 0.125, offset = -1000;
    Writer w(false);
    w.put(std::string("LASF")).pad(24).put(std::uint8_t(1)).put(std::uint8_t(minor)).pad(94).put(header);
    w.put(std::uint32_t(header + 10)).put(std::uint32_t(0)).put(format).put(stride);
    w.put(std::uint32_t(minor == 4 ? 0 : points.size())).pad(131);
    for (int a = 0; a < 3; ++a) w.put(scale);
    for (int a = 0; a < 3; ++a) w.put(offset);
    if (minor == 4) w.pad(247).put(std::uint64_t(points.size()));
    w.pad(header + 10U);
    for (const Vec3& p : points) {
        const std::size_t begin = w.size();
        for (int a = 0; a < 3; ++a) w.put(std::int32_t(std::lround((p[a] - offset) / scale)));
        w.pad(begin + stride);
    }
    return w.text();
}

// ---- the same marks in every format

ImageGeometry image() {
    ImageGeometry geometry;
    geometry.size = {64, 48, 20};
    geometry.spacing = {0.5, 2, 4};
    geometry.origin = {-7, 11, 30};
    return geometry;
}

/// One line for each mark. In the pattern, # stands for the mark's number from 0, and X, Y and Z for its coordinates.
std::string rows(const std::vector<Vec3>& points, const std::string& pattern) {
    std::string text;
    int n = 0;
    for (const Vec3& p : points) {
        for (const char c : pattern) {
            if (c == '#')
                text += std::to_string(n);
            else if (c >= 'X' && c <= 'Z')
                text += std::to_string(p[std::size_t(c - 'X')]);
            else
                text += c;
        }
        text += '\n';
        ++n;
    }
    return text;
}

std::vector<Vec3> moved(std::vector<Vec3> points, const Vec3& scale, const Vec3& shift) {
    for (Vec3& p : points)
        for (int a = 0; a < 3; ++a) p[a] = scale[a] * p[a] + shift[a];
    return points;
}

RoiSpec multi_point() {
    RoiSpec spec;
    spec.type = kPoint;
    for (const Vec3& p : kIndex) {
        spec.xy.push_back({float(p[0]), float(p[1])});
        spec.positions.push_back(int(p[2]) + 1);
    }
    return spec;
}

std::string markups(const std::vector<Vec3>& points, const std::string& type, const std::string& system) {
    std::string text =
        R"({"@schema": "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#",
 "markups": [{"type": ")" +
        type + R"(", "coordinateSystem": ")" + system + R"(", "coordinateUnits": "mm", "controlPoints": [
 {"id": "0", "label": "not yet", "position": [0, 0, 0], "positionStatus": "undefined"})";
    for (const Vec3& p : points)
        text += ",\n {\"id\": \"1\", \"label\": \"F-1\", \"position\": [" + std::to_string(p[0]) + ", " +
                std::to_string(p[1]) + ", " + std::to_string(p[2]) + "], \"positionStatus\": \"defined\"}";
    return text + "]}]}";
}

struct File {
    const char* name;
    std::string content;
    const char* rule;  ///< part of the expected summary
};

std::vector<File> all_formats() {
    const ImageGeometry g = image();
    std::vector<Vec3> world, ras;
    for (const Vec3& p : kIndex) {
        world.push_back(g.index_to_world(p));
        ras.push_back({-world.back()[0], -world.back()[1], world.back()[2]});
    }
    const std::vector<Vec3> fiji = moved(kIndex, {g.spacing[0], g.spacing[1], 1}, {0, 0, 1});
    const std::string fcsv = "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n";
    RoiSpec by_name = outline(kTraced, 4);
    by_name.position = 0;
    by_name.name = "0005-0032-0010";
    return {
        {"a.xyz", rows(world, "X Y Z"), "x, y, z in world units"},
        {"a.csv", "x,y,z\n" + rows(world, "X,Y,Z"), "x, y, z in world units"},
        {"a.tsv", "slice\tx_px\ty_px\n" + rows(kIndex, "Z\tX\tY"), "in voxels"},
        {"b.csv", "slice,contour,x_px,y_px\n" + rows(kIndex, "Z,0,X,Y"), "lines by slice and contour"},
        {"napari.csv", "index,axis-0,axis-1,axis-2\n" + rows(kIndex, "#,Z,Y,X"), "napari points, as z, y, x in voxels"},
        {"napari4.csv", "index,axis-0,axis-1,axis-2,axis-3\n" + rows(kIndex, "#,0,Z,Y,X"), "napari points"},
        {"shapes.csv", "index,shape-type,vertex-index,axis-0,axis-1,axis-2\n" + rows(kIndex, "0,path,#,Z,Y,X"),
         "napari shapes"},
        {"Results.csv", " ,Area,Mean,X,Y,Ch,Slice\n" + rows(fiji, "#,0,7,X,Y,1,Z"), "Fiji Results, slices from 1"},
        {"multi.roi", roi(multi_point()), "Fiji ROIs (1 point), slices from 1"},
        {"set.zip", zip({{"a.roi", roi(outline(kPolygon, 3))}, {"readme.txt", "no ROI"}, {"b.roi", roi(by_name)}}),
         "1 polygon, 1 traced"},
        {"stored.zip", zip({{"multi.roi", roi(multi_point())}}, false), "1 point"},
        {"cells.xml", cell_counter(kIndex), "Fiji's Cell Counter (2 types), slices from 1"},
        {"lps.mrk.json", markups(world, "Fiducial", "LPS"), "3D Slicer markups (Fiducial), as x, y, z in world units"},
        {"ras.mrk.json", markups(ras, "ClosedCurve", "RAS"), "RAS turned to LPS"},
        {"old.fcsv",
         "# Markups fiducial file version = 4.6\n# CoordinateSystem = 0\n" + fcsv +
             rows(ras, "m#,X,Y,Z,0,0,0,1,1,1,0,F-1,,"),
         "RAS turned to LPS"},
        {"new.fcsv", "# CoordinateSystem = LPS\n" + fcsv + rows(world, "#,X,Y,Z,0,0,0,1,1,1,0,\"F, 1\",,"),
         "stated, as x, y, z in world units"},
        {"older.fcsv", "# columns = label,x,y,z,sel,vis\n" + rows(ras, "F,X,Y,Z,1,1"),
         "not stated, RAS as in old files"},
        {"c3d.landmarks", rows(ras, "X Y Z 1"), "Convert3D"},
        {"named.lmk", rows(ras, "tip X Y Z"), "RAS turned to LPS"},
        {"snap.annot",
         "<entry key=\"Format\" value=\"ITK-SNAP Annotation File\" />\n" +
             rows(moved(kIndex, {1, 1, 1}, {0.5, 0.5, 0.5}), "<entry key=\"Pos\" value=\"X Y Z\" />"),
         "ITK-SNAP"},
        {"ascii.pcd", pcd(world, "ascii"), "PCD (ascii)"},
        {"binary.pcd", pcd(world, "binary"), "PCD (binary)"},
        {"packed.pcd", pcd(world, "binary_compressed"), "PCD (binary_compressed)"},
        {"a.las", las(world, 2), "LAS 1.2 (format 1)"},
        {"b.las", las(world, 4, 6), "LAS 1.4 (format 6)"},
        {"a.obj", rows(world, "v X Y Z"), "OBJ"},
        {"a.off", "OFF\n4 0 0\n" + rows(world, "X Y Z"), "OFF"},
        {"a.ply",
         "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nend_header\n" +
             rows(world, "X Y Z"),
         "PLY"},
    };
}

}  // namespace

TEST_CASE("The same marks in every format have the same world positions") {
    const Scratch scratch;
    const ImageGeometry g = image();
    for (const File& file : all_formats()) {
        INFO(file.name);
        const PointCloud cloud = read_points(scratch.write(file.name, file.content));
        INFO(cloud.rule);
        CHECK(cloud.rule.find(file.rule) != std::string::npos);
        const std::vector<Vec3> world = to_world(cloud, g);
        REQUIRE(world.size() == kIndex.size());
        for (std::size_t n = 0; n < world.size(); ++n) {
            const Vec3 expected = g.index_to_world(kIndex[n]);
            for (int a = 0; a < 3; ++a) CHECK(world[n][a] == Approx(expected[a]).margin(1e-5));
        }
        CHECK_NOTHROW(check_inside(cloud, g));
    }
}

TEST_CASE("Reading options take precedence over the conventions of the format") {
    const Scratch scratch;
    const std::string path = scratch.write("a.mrk.json", markups({{1, 2, 3}}, "Fiducial", "RAS"));
    CHECK(read_points(path).points[0] == Vec3{-1, -2, 3});
    CHECK(read_points(path, {PointSpace::World}).points[0] == Vec3{1, 2, 3});
    CHECK(read_points(path, {PointSpace::Unstated, PointOrder::ZYX}).points[0] == Vec3{-3, -2, 1});
    CHECK(read_points(path, {PointSpace::World, PointOrder::XYZ, 0.5}).points[0] == Vec3{0.5, 1, 1.5});
    const PointCloud index = read_points(path, {PointSpace::IndexOne});
    CHECK(index.points[0] == Vec3{0, 1, 2});
    CHECK(index.space == PointSpace::Index);
    // A multi-point that was clicked in a hyperstack of two channels: its images 1 and 2 are slice 0.
    RoiSpec spec = multi_point();
    spec.positions = {1, 2, 3, 8};
    ReadPointsOptions two;
    two.channels = 2;
    const PointCloud cloud = read_points(scratch.write("two.roi", roi(spec)), two);
    const double slices[] = {0, 0, 1, 3};
    for (std::size_t n = 0; n < 4; ++n) CHECK(cloud.points[n][2] == slices[n]);
    CHECK_THROWS_AS(read_points(path, {PointSpace::World, PointOrder::XYZ, -1}), Error);
    two.channels = 0;
    CHECK_THROWS_AS(read_points(path, two), Error);
}

TEST_CASE("PCD and LAS: invalid points are omitted, compressed, newer and truncated files are rejected") {
    const Scratch scratch;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const char* data : {"ascii", "binary", "binary_compressed"}) {
        const PointCloud cloud =
            read_points(scratch.write("a.pcd", pcd({{1, 2, 3}, {nan, nan, nan}, {4, 5, 6}}, data)));
        CHECK(cloud.points == std::vector<Vec3>{{1, 2, 3}, {4, 5, 6}});
        contains(cloud.rule, "1 invalid ones left out");
    }
    contains(read_error(scratch, "a.laz", "LASF"), "LAZ is not read; unpack it");
    contains(read_error(scratch, "a.las", las({{1, 2, 3}}, 2, 0x80 | 1)), "its compressed form LAZ");
    contains(read_error(scratch, "a.las", las({{1, 2, 3}}, 5)), "expected LAS 1.0 to 1.4, got 1.5");
    contains(read_error(scratch, "a.las", las({{1, 2, 3}}, 2).substr(0, 250)),
             "expected 1 points of 28 bytes from byte 237");
    contains(read_error(scratch, "a.pcd", "FIELDS x y\nSIZE 4 4\nTYPE F F\nCOUNT 1 1\nPOINTS 1\nDATA ascii\n1 2\n"),
             "expected a field 'z'");
    const std::string whole = pcd({{1, 2, 3}, {4, 5, 6}}, "binary");
    contains(read_error(scratch, "a.pcd", whole.substr(0, whole.size() - 1)), "truncated");
    contains(read_error(scratch, "a.pcd", "FIELDS x y z\nPOINTS 999999999999\nDATA binary\nabc"), "truncated");
}

TEST_CASE("ZIP archives of ROIs: false sizes, encryption and wrong checksums are rejected") {
    const Scratch scratch;
    contains(read_error(scratch, "a.zip", "PK nothing"), "expected a ZIP archive");
    contains(read_error(scratch, "a.zip", zip({{"a.txt", "text"}})), "expected Fiji ROIs in the archive, got none");
    contains(read_error(scratch, "a.zip", zip({{"a.roi", "no ROI"}})), "expected a Fiji ROI");
    std::string archive = zip({{"a.roi", roi(multi_point())}});
    const std::size_t entry = archive.find("PK\1\2");
    std::string huge = archive;
    huge.replace(entry + 24, 4, "\xF0\xFF\xFF\xFF");  // the size that the archive's directory claims
    contains(read_error(scratch, "a.zip", huge), "bytes cannot hold 4294967280");
    std::string secret = archive;
    secret[entry + 8] = 1;
    contains(read_error(scratch, "a.zip", secret), "is encrypted");
    std::string broken = archive;
    broken[entry + 16] ^= 1;  // the checksum in the archive's directory
    contains(read_error(scratch, "a.zip", broken), "does not match its checksum");
}

TEST_CASE("Damaged point files of every format never crash the reader") {
    const Scratch scratch;
    for (const File& file : all_formats()) {
        INFO(file.name);
        const FuzzCounts counts = fuzz(
            scratch, scratch.write(file.name, file.content), [](const std::string& path) { (void)read_points(path); },
            15);
        CHECK(counts.flipped > 0);
    }
}
