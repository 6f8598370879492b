#include <catch2/catch.hpp>
#include <cmath>

#include "covol/point_structures.h"
#include "covol/points.h"
#include "support/scratch.h"
#include "unit/io/points/program_files.h"

// What only the files of marking programs have: lines, structures, their own lattices and slices.

using namespace covol;
using namespace covol::test;

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
