#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "covol/error.h"
#include "io/points/point_formats.h"
#include "io/points/point_text.h"

// Marks of programs that use anatomical coordinates: 3D Slicer, ITK-SNAP, Convert3D.
namespace covol::detail {
namespace {

using Json = nlohmann::json;
using std::string_view;

/// @throws Error InvalidInput for a system that is neither RAS nor LPS.
PointSpace to_space(const std::string& path, const std::string& system) {
    if (system == "RAS" || system == "0") return PointSpace::Ras;
    if (system == "LPS" || system == "1") return PointSpace::World;
    fail(path, "expected the coordinate system RAS or LPS, got " + quote(system));
}

void turn(std::vector<Vec3>& points) {
    for (Vec3& p : points) p = {-p[0], -p[1], p[2]};
}

Vec3 to_point(const std::string& path, const Json& position) {
    if (!position.is_array() || position.size() != 3)
        fail(path, "expected a position of 3 numbers in each control point");
    Vec3 point;
    for (std::size_t a = 0; a < 3; ++a) {
        if (!position[a].is_number()) fail(path, "expected a position of 3 numbers in each control point");
        point[a] = position[a].get<double>();
        if (!std::isfinite(point[a])) fail(path, "expected finite positions");
    }
    return point;
}

struct ControlPoints {
    std::vector<Vec3> points;
    std::vector<std::string> labels;  ///< the label of each point, as the user has entered it
};

ControlPoints control_points(const std::string& path, const Json& markup) {
    ControlPoints found;
    if (!markup.contains("controlPoints")) return found;
    for (const Json& control : markup.at("controlPoints")) {
        const std::string status = control.value("positionStatus", "defined");
        if (status != "defined" && status != "nonblocking") continue;
        found.points.push_back(to_point(path, control.at("position")));
        found.labels.push_back(control.value("label", ""));
    }
    return found;
}

PointTable read_markups(const std::string& path, const Json& file, const std::string& structures_by) {
    PointTable table;
    table.order = PointOrder::XYZ;
    std::string kinds;
    if (!file.is_object() || !file.contains("markups") || !file.at("markups").is_array())
        fail(path, "expected 3D Slicer's markups, found no list 'markups'");
    for (const Json& markup : file.at("markups")) {
        const std::string type = markup.value("type", "Fiducial");
        auto [points, labels] = control_points(path, markup);
        if (points.empty() || type == "ROI" || type == "Plane") continue;
        // Slicer's default is LPS. If a file has both systems, all points are converted to the first system in the
        // file.
        const PointSpace space = to_space(path, markup.value("coordinateSystem", "LPS"));
        if (table.space == PointSpace::Unstated) table.space = space;
        if (space != table.space) turn(points);
        const std::string name = markup.value("name", "");
        const bool by_label = structures_by == "label";
        if (type == "ClosedCurve" || type == "Curve" || type == "Line" || type == "Angle") {
            add_line(table, points, type == "ClosedCurve", name);
            if (by_label) name_structure(table, path, labels.front());
        } else {
            for (std::size_t n = 0; n < points.size(); ++n) {
                table.points.push_back(points[n]);
                if (by_label) name_structure(table, path, labels[n]);
            }
        }
        if (structures_by == "node") name_structure(table, path, name);
        kinds += (kinds.empty() ? "" : ", ") + type;
    }
    constexpr std::size_t kLongest = 80;
    if (kinds.size() > kLongest) kinds = kinds.substr(0, kLongest) + "...";
    table.rule = "3D Slicer markups (" + kinds + ")";
    return table;
}

}  // namespace

PointTable parse_markups(const std::string& path, const std::string& text, const std::string& structures_by) {
    try {
        return read_markups(path, Json::parse(text), structures_by);
    } catch (const Json::exception& e) {
        fail(path, std::string("not the JSON of 3D Slicer's markups: ") + e.what());
    }
}

PointTable parse_fcsv(const std::string& path, const std::string& text, const std::string& structures_by) {
    PointTable table;
    table.order = PointOrder::XYZ;
    std::string system = "RAS";  // the system of files that state none, which Slicer wrote before version 4.11
    bool stated = false;
    std::array<std::size_t, 3> at{1, 2, 3};
    std::size_t label = 11;  // index of the column with labels, unless the file names the columns
    Lines lines(text);
    string_view line;
    std::vector<string_view> fields;
    const auto setting = [&](string_view key, string_view& value) {
        string_view rest = trim(line.substr(1));
        if (lower(rest.substr(0, key.size())) != key) return false;
        rest = trim(rest.substr(key.size()));
        if (rest.empty() || rest.front() != '=') return false;
        value = trim(rest.substr(1));
        return true;
    };
    while (lines.next(line)) {
        if (line.empty()) continue;
        if (line.front() == '#') {
            string_view value;
            if (setting("coordinatesystem", value)) {
                system = value;
                stated = true;
            } else if (setting("columns", value)) {
                split(value, ',', fields);
                for (std::size_t n = 0; n < fields.size(); ++n) {
                    if (fields[n].size() == 1 && fields[n][0] >= 'x' && fields[n][0] <= 'z')
                        at[static_cast<std::size_t>(fields[n][0] - 'x')] = n;
                    if (fields[n] == "label") label = n;
                }
            }
            continue;
        }
        split(line, ',', fields);
        Vec3 point;
        for (std::size_t a = 0; a < 3; ++a) {
            if (at[a] >= fields.size())
                fail(path, lines.number(),
                     "expected " + std::to_string(at[a] + 1) + " columns, got " + std::to_string(fields.size()));
            point[a] = to_coordinate(path, lines.number(), fields[at[a]]);
        }
        table.points.push_back(point);
        if (structures_by == "label")
            name_structure(table, path, std::string(label < fields.size() ? fields[label] : string_view()));
    }
    table.space = to_space(path, system);
    table.rule =
        std::string("3D Slicer fiducials, CoordinateSystem ") + (stated ? "stated" : "not stated, RAS as in old files");
    return table;
}

PointTable parse_landmarks(const std::string& path, const std::string& text) {
    PointTable table;
    table.order = PointOrder::XYZ;
    table.space = PointSpace::Ras;
    table.rule = "landmarks of Convert3D";
    Lines lines(text);
    string_view line;
    std::vector<string_view> fields;
    while (lines.next_words(line, fields)) {
        if (fields.size() < 4)
            fail(path, lines.number(), "expected x y z and a label, or a label and x y z, got " + quote(line));
        // If the first field is a number, it is x, and a label follows z. Otherwise the first field is the label.
        const std::size_t first = to_number(fields[0]) ? 0 : 1;
        Vec3 point;
        for (std::size_t a = 0; a < 3; ++a) point[a] = to_coordinate(path, lines.number(), fields[first + a]);
        table.points.push_back(point);
    }
    return table;
}

PointTable parse_annotations(const std::string& path, const std::string& text) {
    if (text.find("ITK-SNAP Annotation File") == std::string::npos) fail(path, "expected an ITK-SNAP annotation file");
    PointTable table;
    table.space = PointSpace::Index;
    table.order = PointOrder::XYZ;
    table.rule = "ITK-SNAP annotations, by voxel corners";
    std::vector<string_view> fields;
    Vec3 first{};
    bool has_first = false;
    Lines lines(text);
    string_view line;
    while (lines.next(line)) {
        const auto attribute = [&](string_view name) {
            const std::size_t begin = line.find(name);
            if (begin == string_view::npos) return string_view();
            const string_view rest = line.substr(begin + name.size());
            return rest.substr(0, rest.find('"'));
        };
        const string_view key = attribute("key=\"");
        if (key != "Pos" && key != "Point1" && key != "Point2") continue;
        split(attribute("value=\""), ' ', fields);
        if (fields.size() != 3) fail(path, lines.number(), "expected 3 numbers, got " + std::to_string(fields.size()));
        Vec3 point;
        for (std::size_t a = 0; a < 3; ++a) point[a] = to_coordinate(path, lines.number(), fields[a]) - 0.5;
        if (key == "Pos") {
            table.points.push_back(point);
        } else if (key == "Point1") {
            first = point;
            has_first = true;
        } else {
            if (!has_first) fail(path, lines.number(), "a line segment has a Point2 and no Point1");
            add_line(table, {first, point}, false, "");
            has_first = false;
        }
    }
    return table;
}

}  // namespace covol::detail
