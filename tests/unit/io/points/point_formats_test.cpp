
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>

#include "covol/point_structures.h"
#include "covol/points.h"
#include "support/deflated.h"
#include "support/scratch.h"

// Each format, byte by byte according to its specification.

using namespace covol;

namespace {

// ---- bytes

class Writer {
public:
    explicit Writer(bool big) : big_(big) {}
    template <typename T>
    Writer& put(T value) {
        std::array<char, sizeof(T)> bytes;
        std::memcpy(bytes.data(), &value, sizeof(T));
        if (big_) std::reverse(bytes.begin(), bytes.end());
        text_.append(bytes.data(), sizeof(T));
        return *this;
    }
    template <typename T>
    Writer& put_at(std::size_t at, T value) {
        const std::string tail = text_.size() > at + sizeof(T) ? text_.substr(at + sizeof(T)) : "";
        text_.resize(at, '\0');
        put(value);
        text_ += tail;
        return *this;
    }
    Writer& put(const std::string& text) {
        text_ += text;
        return *this;
    }
    Writer& pad(std::size_t size) {
        text_.resize(size, '\0');
        return *this;
    }
    [[nodiscard]] std::size_t size() const { return text_.size(); }
    [[nodiscard]] const std::string& text() const { return text_; }

private:
    bool big_;
    std::string text_;
};

// ---- Fiji

enum RoiType : std::uint8_t {
    kPolygon = 0,
    kRectangle = 1,
    kOval = 2,
    kLine = 3,
    kFreeLine = 4,
    kPolyline = 5,
    kFreehand = 7,
    kTraced = 8,
    kPoint = 10
};

struct RoiSpec {
    RoiType type = kPolygon;
    std::vector<std::array<float, 2>> xy;
    bool sub_pixel = true;
    std::vector<int> positions;  ///< slice of each point, from 1
    int position = 0, z = 0, channel = 0;
    std::string name;
    std::array<float, 4> box{};  ///< x, y, width and height, or the two ends of a line
    std::vector<float> path;     ///< the path of a composite ROI
};

std::string roi(const RoiSpec& spec) {
    const std::size_t n = spec.xy.size();
    const bool has_box = spec.type == kRectangle || spec.type == kOval || spec.type == kLine;
    const float left = has_box ? spec.box[0] : 5, top = has_box ? spec.box[1] : 6;
    Writer w(true);
    w.put(std::string("Iout")).put(std::int16_t(228)).put(std::uint8_t(spec.type)).put(std::uint8_t(0));
    w.put(std::int16_t(top))
        .put(std::int16_t(left))
        .put(std::int16_t(top + spec.box[3]))
        .put(std::int16_t(left + spec.box[2]));
    w.put(std::uint16_t(n));
    if (has_box && spec.sub_pixel)
        for (const float v : spec.box) w.put(v);
    w.pad(36).put(std::int32_t(spec.path.size())).pad(50);
    w.put(std::int16_t(spec.sub_pixel ? 128 : 0)).pad(56).put(std::int32_t(spec.position));
    const std::size_t second = 64 + 4 * spec.path.size() + (spec.sub_pixel ? 12 : 4) * n;
    w.put(std::int32_t(second));
    for (const float v : spec.path) w.put(v);
    for (int a = 0; a < 2; ++a)
        for (const auto& p : spec.xy) w.put(std::int16_t(p[std::size_t(a)] - (a == 0 ? left : top)));
    if (spec.sub_pixel)
        for (int a = 0; a < 2; ++a)
            for (const auto& p : spec.xy) w.put(p[std::size_t(a)]);
    w.pad(second + 4).put(std::int32_t(spec.channel)).put(std::int32_t(spec.z)).put(std::int32_t(0));
    w.put(std::int32_t(spec.name.empty() ? 0 : second + 64)).put(std::int32_t(spec.name.size()));
    const std::size_t counters = second + 64 + 2 * spec.name.size();
    w.pad(second + 48).put(std::int32_t(spec.positions.empty() ? 0 : counters)).pad(second + 64);
    for (const char c : spec.name) w.put(std::int16_t(c));
    for (const int position : spec.positions) w.put(std::int32_t(position << 8 | 3));
    return w.text();
}

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

const std::vector<Vec3> kIndex{{10, 20, 3}, {12.5, 20.25, 3}, {12.5, 31, 3}, {10.25, 31.75, 4}};

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

/// Markers of Fiji's Cell Counter, in types of two markers, followed by an empty type.
std::string cell_counter(const std::vector<Vec3>& points, bool named = false) {
    std::string text =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\r\n<CellCounter_Marker_File>\r\n <Image_Properties>\r\n"
        "     <Image_Filename>a.tif</Image_Filename>\r\n </Image_Properties>\r\n <Marker_Data>\r\n"
        "     <Current_Type>0</Current_Type>\r\n";
    for (std::size_t type = 0; 2 * type <= points.size(); ++type) {
        text += "     <Marker_Type>\r\n         <Type>" + std::to_string(type + 1) + "</Type>\r\n";
        if (named) text += "         <Name>cell &lt;" + std::to_string(type + 1) + "&gt;</Name>\r\n";
        for (std::size_t n = 2 * type; n < std::min(points.size(), 2 * type + 2); ++n)
            text += "         <Marker>\r\n             <MarkerX>" + std::to_string(points[n][0]) +
                    "</MarkerX>\r\n             <MarkerY>" + std::to_string(points[n][1]) +
                    "</MarkerY>\r\n             <MarkerZ>" + std::to_string(int(points[n][2]) + 1) +
                    "</MarkerZ>\r\n         </Marker>\r\n";
        text += "     </Marker_Type>\r\n";
    }
    return text + " </Marker_Data>\r\n</CellCounter_Marker_File>\r\n";
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

/// The marks of one slice as the outline of an area, in coordinates of pixel corners.
RoiSpec outline(RoiType type, int slice) {
    RoiSpec spec;
    spec.type = type;
    for (const Vec3& p : kIndex)
        if (p[2] == slice) spec.xy.push_back({float(p[0] + 0.5), float(p[1] + 0.5)});
    spec.position = slice + 1;
    spec.name = "outline";
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

std::string read_error(const Scratch& scratch, const std::string& name, const std::string& content) {
    const std::string path = scratch.write(name, content);
    return message_of([&] { (void)read_points(path); });
}

void contains(const std::string& message, const std::string& part) {
    INFO(message);
    CHECK(message.find(part) != std::string::npos);
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

TEST_CASE("Line segments of ITK-SNAP are read as lines of two marks") {
    const Scratch scratch;
    const std::string head = "<entry key=\"Format\" value=\"ITK-SNAP Annotation File\" />\n";
    const std::string begin = "<entry key=\"Point1\" value=\"1.5 2.5 3.5\" />\n",
                      end = "<entry key=\"Point2\" value=\"4.5 2.5 3.5\" />\n";
    const PointCloud cloud = read_points(scratch.write("a.annot", head + begin + end));
    REQUIRE(cloud.points.size() == 2);
    CHECK(cloud.points[0][0] < cloud.points[1][0]);
    REQUIRE(cloud.lines.size() == 1);
    CHECK_FALSE(cloud.lines[0].closed);
    contains(read_error(scratch, "a.annot", head + end), "a Point2 and no Point1");
}

TEST_CASE("Fiji ROIs: areas are in pixel-corner coordinates, lines in pixel-centre coordinates") {
    const Scratch scratch;
    const auto read = [&](const RoiSpec& spec) { return read_points(scratch.write("one.roi", roi(spec))); };
    RoiSpec spec;
    spec.position = 4;
    spec.xy = {{10, 20}, {14, 20}, {14, 26}};
    for (const RoiType type : {kPolygon, kFreehand, kTraced, kFreeLine, kPolyline}) {
        INFO(int(type));
        for (const bool sub_pixel : {false, true}) {
            spec.type = type;
            spec.sub_pixel = sub_pixel;
            const PointCloud cloud = read(spec);
            const bool area = type != kFreeLine && type != kPolyline;
            const double shift = area ? -0.5 : 0;
            REQUIRE(cloud.lines.size() == 1);
            CHECK(cloud.lines[0].closed == area);
            CHECK(cloud.points == std::vector<Vec3>{{10 + shift, 20 + shift, 3},
                                                    {14 + shift, 20 + shift, 3},
                                                    {14 + shift, 26 + shift, 3}});
        }
    }
    spec.xy.clear();
    for (const bool sub_pixel : {false, true}) {
        spec.sub_pixel = sub_pixel;
        spec.box = {10, 20, 6, 8};
        spec.type = kRectangle;
        CHECK(read(spec).points == std::vector<Vec3>{{9.5, 19.5, 3}, {15.5, 19.5, 3}, {15.5, 27.5, 3}, {9.5, 27.5, 3}});
        spec.type = kOval;
        const PointCloud oval = read(spec);
        CHECK(oval.lines.at(0).closed);
        CHECK(oval.points.size() >= 16);
        for (const Vec3& p : oval.points)
            CHECK(std::pow((p[0] - 12.5) / 3, 2) + std::pow((p[1] - 23.5) / 4, 2) == Approx(1));
    }
    spec.type = kLine;
    // Both ends of the line, in coordinates of pixel centres.
    CHECK(read(spec).points == std::vector<Vec3>{{10, 20, 3}, {6, 8, 3}});
    CHECK_FALSE(read(spec).lines[0].closed);

    // The path of a square with a square hole.
    spec.type = kRectangle;
    spec.path = {0, 10, 10, 1, 20, 10, 1, 20, 20, 1, 10, 20, 1, 10, 10, 4, 0, 12, 12, 1, 18, 12, 1, 18, 18, 4};
    const PointCloud composite = read(spec);
    REQUIRE(composite.lines.size() == 2);
    CHECK(composite.lines[0].end == 4);
    CHECK(composite.lines[1].end == 7);
    CHECK(composite.points[4] == Vec3{11.5, 11.5, 3});
}

TEST_CASE("Fiji ROIs: the slice is the z of the hyperstack, else the position, else in the name, none is an error") {
    const Scratch scratch;
    RoiSpec spec = outline(kPolygon, 3);
    spec.position = 77;
    spec.z = 6;
    spec.channel = 2;
    CHECK(read_points(scratch.write("a.roi", roi(spec))).points[0][2] == 5);
    spec.z = spec.channel = 0;
    CHECK(read_points(scratch.write("a.roi", roi(spec))).points[0][2] == 76);
    spec.position = 0;
    spec.name = "0012-0100-0200";
    const PointCloud cloud = read_points(scratch.write("a.roi", roi(spec)));
    CHECK(cloud.points[0][2] == 11);
    CHECK(cloud.lines[0].name == "0012-0100-0200");
    spec.name = "cell";
    contains(read_error(scratch, "a.roi", roi(spec)), "ROI 'cell' (polygon): expected a slice");
    spec.position = 3;
    spec.channel = 1;  // the ROI belongs to all slices of channel 1
    contains(read_error(scratch, "a.roi", roi(spec)), "expected a slice");
}

TEST_CASE("Cell Counter: types are read as structures, and slices that count channels are converted") {
    const Scratch scratch;
    const std::string path = scratch.write("a.xml", cell_counter(kIndex));
    std::vector<StructurePoints> structures = read_structures_of_points(path, "type");
    REQUIRE(structures.size() == 2);
    CHECK(structures[0].name == "Type 1");
    CHECK(structures[1].name == "Type 2");
    CHECK(structures[1].points.cloud.points == std::vector<Vec3>{kIndex[2], kIndex[3]});
    structures = read_structures_of_points(scratch.write("n.xml", cell_counter(kIndex, true)), "type");
    REQUIRE(structures.size() == 2);
    CHECK(structures[1].name == "cell <2>");
    contains(message_of([&] { (void)read_structures_of_points(path, "group"); }), "its Cell Counter with type");
    ReadPointsOptions two;
    two.channels = 2;
    CHECK(read_points(path, two).points[0][2] == 1);  // image 4 of a hyperstack with two channels is slice 1
    CHECK(read_points(path, two).points[3][2] == 2);
}

TEST_CASE("Cell Counter: other XML files and incomplete ones are rejected with the reason") {
    const Scratch scratch;
    const std::string good = cell_counter(kIndex);
    const auto with = [&](const std::string& old, const std::string& other) {
        std::string text = good;
        return text.replace(text.find(old), old.size(), other);
    };
    contains(read_error(scratch, "a.xml", "<TrackMate version=\"7\"/>"), "got 'TrackMate'");
    contains(read_error(scratch, "a.xml", "no XML"), "expected a file of Fiji's Cell Counter");
    contains(read_error(scratch, "a.xml", good.substr(0, good.size() - 5)), "has no end");
    contains(read_error(scratch, "a.xml", with("<MarkerZ>4</MarkerZ>", "")),
             "marker 1: expected MarkerX, MarkerY and MarkerZ");
    contains(read_error(scratch, "a.xml", with("<MarkerZ>4<", "<MarkerZ>0<")),
             "marker 1: expected a slice from 1, got MarkerZ '0'; does the file count slices from 0?");
    contains(read_error(scratch, "a.xml", with("</Type>", "</Type><Name><Unnamed></Name>")), "write it as &lt;");
    contains(read_error(scratch, "a.xml", with("</Type>", "</Type><Name>a < 5 um</Name>")), "write it as &lt;");
    contains(read_error(scratch, "a.xml", good.substr(0, good.find("</Type>")) + "</Type><Name>cell"), "has no end");
    contains(read_error(scratch, "a.xml", with("<MarkerX>", "<Marker><MarkerX>")), "marker 1: expected its end");
    contains(read_error(scratch, "a.xml", with("<Type>1</Type>", "")), "marker 1: expected the Type or Name");
    contains(read_error(scratch, "a.xml", "<?xml version=\"1.0\"?><SpimData version=\"0.2\"/>"), "open the .h5 file");
    contains(read_error(scratch, "a.xml", with("<MarkerZ>4<", "<MarkerZ>nan<")), "expected a number as MarkerZ");
    contains(read_error(scratch, "a.xml", "<CellCounter_Marker_File></CellCounter_Marker_File>"),
             "expected at least one point");
}

TEST_CASE("Cell Counter: line ends around numbers are accepted, and files of cellfinder count slices from 0") {
    const Scratch scratch;
    std::string text = cell_counter(kIndex);
    const auto set = [&](const std::string& old, const std::string& other) {
        text.replace(text.find(old), old.size(), other);
    };
    set("<MarkerZ>4</MarkerZ>", "<MarkerZ>\r\n  4\r\n</MarkerZ>");
    CHECK(read_points(scratch.write("a.xml", text)).points == kIndex);
    set("</Type>", "</Type><Name />");  // a type without a name is called by its number
    CHECK(read_structures_of_points(scratch.write("n.xml", text), "type")[0].name == "Type 1");
    set("a.tif", "placeholder.tif");
    const PointCloud cloud = read_points(scratch.write("b.xml", text));
    CHECK(cloud.points[0] == Vec3{kIndex[0][0], kIndex[0][1], kIndex[0][2] + 1});
    contains(cloud.rule, "cellfinder (2 types), slices from 0");
}

TEST_CASE("3D Slicer markups: curves are read as named lines, planes are ignored, invalid files are rejected") {
    const Scratch scratch;
    const std::string text =
        R"({"markups": [
          {"type": "ClosedCurve", "name": "rim", "coordinateSystem": "RAS", "controlPoints": [{"position": [1, 2, 3]}, {"position": [4, 5, 6]}]},
          {"type": "Line", "coordinateSystem": "LPS", "controlPoints": [{"position": [-7, -8, 9]}, {"position": [-1, -1, 1]}]},
          {"type": "Plane", "coordinateSystem": "LPS", "controlPoints": [{"position": [0, 0, 0]}]},
          {"type": "Curve", "controlPoints": []}]})";
    const PointCloud cloud = read_points(scratch.write("a.mrk.json", text));
    REQUIRE(cloud.lines.size() == 2);
    CHECK(cloud.lines[0].closed);
    CHECK(cloud.lines[0].name == "rim");
    CHECK_FALSE(cloud.lines[1].closed);
    CHECK(cloud.points == std::vector<Vec3>{{-1, -2, 3}, {-4, -5, 6}, {-7, -8, 9}, {-1, -1, 1}});
    contains(
        read_error(scratch, "a.json",
                   "{\"markups\": [{\"coordinateSystem\": \"IJK\", \"controlPoints\": [{\"position\": [1,2,3]}]}]}"),
        "expected the coordinate system RAS or LPS, got 'IJK'");
    contains(read_error(scratch, "a.json", "{\"markups\": 3}"), "found no list 'markups'");
    contains(read_error(scratch, "a.json", "{\"markups\": [{\"controlPoints\": [{\"position\": [1,2]}]}]}"),
             "expected a position of 3 numbers");
    contains(read_error(scratch, "a.json", "{\"markups\": [{\"controlPoints\": [{\"position\": [1,2,1e999]}]}]}"),
             "a.json: not the JSON");
    contains(read_error(scratch, "a.json", std::string(100000, '[')), "a.json: not the JSON");
    contains(read_error(scratch, "a.json", "{\"markups\": [{\"type\": 5, \"controlPoints\": 7}]}"),
             "a.json: not the JSON");
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
