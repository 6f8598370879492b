#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>
#include <optional>

#include "covol/error.h"
#include "io/points/point_formats.h"
#include "io/points/point_text.h"

namespace covol::detail {
namespace {

using std::string_view;

// ---------------------------------------------------------------------------------------------- header

/// Which columns hold a point, and which tell the line that it belongs to.
struct Columns {
    std::array<std::size_t, 3> at{0, 1, 2};
    PointSpace space = PointSpace::Unstated;
    PointOrder order = PointOrder::Unstated;
    bool slice_from_one = false;  ///< the third column counts slices from 1
    std::optional<std::array<std::size_t, 3>> normal;
    bool normal_is_guess = false;       ///< the columns have no names
    std::vector<std::size_t> line;      ///< rows that agree in these columns are one line
    std::optional<std::size_t> shape;   ///< napari's shape-type
    std::optional<std::size_t> vertex;  ///< the place of a mark in its line
    bool closed = true;                 ///< lines whose shape is not told
    std::string rule;

    [[nodiscard]] std::size_t count() const {
        std::size_t last = *std::max_element(at.begin(), at.end());
        for (const std::size_t column : line) last = std::max(last, column);
        return std::max({last, shape.value_or(0), vertex.value_or(0)}) + 1;
    }
};

/// A column's name and what is said of its unit: "X (microns)" is {"x", "microns"}, "x_px" is {"x", "px"}.
struct ColumnName {
    std::string name;
    std::string unit;
};

ColumnName parse_name(string_view text) {
    std::string name = lower(trim(text));
    for (const char* prefix : {"position ", "position_", "pos ", "pos_", "coord_", "point_", "//"})
        if (name.rfind(prefix, 0) == 0) name.erase(0, std::strlen(prefix));
    const std::size_t cut = name.find_first_of(" ([_");
    if (cut == std::string::npos || cut == 0) return {name, ""};
    std::string unit = name.substr(cut + 1);
    std::erase_if(unit, [](char c) { return c == '(' || c == ')' || c == '[' || c == ']' || c == ' '; });
    return {name.substr(0, cut), unit};
}

bool means_voxels(const std::string& unit) {
    for (const char* word : {"px", "pix", "pixel", "pixels", "vx", "vox", "voxel", "voxels", "index"})
        if (unit == word) return true;
    return false;
}

/// The columns of a header by name; the first of each name counts.
class Header {
public:
    explicit Header(const std::vector<string_view>& fields) : fields_(fields) {
        for (std::size_t n = 0; n < fields.size(); ++n) {
            const ColumnName column = parse_name(fields[n]);
            columns_.try_emplace(column.name, n);
            units_.try_emplace(column.name, column.unit);
        }
    }
    [[nodiscard]] std::optional<std::size_t> find(const std::string& name) const {
        const auto found = columns_.find(name);
        return found == columns_.end() ? std::nullopt : std::optional(found->second);
    }
    [[nodiscard]] bool in_voxels(const std::string& name) const {
        const auto found = units_.find(name);
        return found != units_.end() && means_voxels(found->second);
    }
    /// "columns X, Y, Z": the columns as the file names them.
    [[nodiscard]] std::string names(const std::array<std::size_t, 3>& at) const {
        std::string text = "columns";
        for (std::size_t a = 0; a < 3; ++a) text += (a == 0 ? " " : ", ") + std::string(fields_[at[a]]);
        return text;
    }

private:
    const std::vector<string_view>& fields_;
    std::map<std::string, std::size_t> columns_;
    std::map<std::string, std::string> units_;
};

/// napari's layers of points and shapes: (t,) z, y, x in voxels.
std::optional<Columns> find_napari(const Header& header) {
    std::vector<std::size_t> axes;
    while (const auto axis = header.find("axis-" + std::to_string(axes.size()))) axes.push_back(*axis);
    if (axes.size() < 3) return std::nullopt;
    Columns columns;
    columns.at = {axes[axes.size() - 3], axes[axes.size() - 2], axes[axes.size() - 1]};
    columns.space = PointSpace::Index;
    columns.order = PointOrder::ZYX;
    columns.shape = header.find("shape-type");
    columns.vertex = header.find("vertex-index");
    const auto index = header.find("index");
    const bool shapes = index && (columns.shape || columns.vertex);
    if (shapes) columns.line = {*index};
    columns.rule = header.names(columns.at) + (shapes ? " of napari shapes" : " of napari points");
    if (axes.size() > 3) columns.rule += ", the axes before them (time, channel) passed over";
    return columns;
}

void find_lines(const Header& header, const std::optional<std::size_t>& slice, Columns& columns) {
    for (const auto& [name, closed] :
         {std::pair{"contour", true}, {"polygon", true}, {"curve", true}, {"polyline", false}, {"path", false}}) {
        const auto column = header.find(name);
        if (!column) continue;
        if (slice) columns.line.push_back(*slice);
        columns.line.push_back(*column);
        columns.closed = closed;
        columns.rule += std::string(", lines by ") + (slice ? "slice and " : "") + name;
        return;
    }
}

std::optional<Columns> find_columns(const std::vector<string_view>& fields) {
    const Header header(fields);
    if (auto columns = find_napari(header)) return columns;
    const auto x = header.find("x"), y = header.find("y"), slice = header.find("slice");
    auto z = header.find("z");
    const bool in_voxels = header.in_voxels("x") && header.in_voxels("y");
    const bool slices = !z && slice;
    if (slices) z = slice;
    if (!x || !y || !z) return std::nullopt;
    Columns columns;
    columns.at = {*x, *y, *z};
    columns.rule = header.names(columns.at);
    if (in_voxels) {
        columns.space = PointSpace::Index;
        columns.order = PointOrder::XYZ;  // the names leave nothing open
        if (slices) columns.rule += ", slices from 0";
    } else if (slices) {
        // Fiji's Results: slices from 1; X and Y in the image's unit wherever the image has one
        columns.space = PointSpace::Slices;
        columns.order = PointOrder::XYZ;
        columns.slice_from_one = true;
        columns.rule += " of Fiji Results, slices from 1, X and Y taken in the image's unit, not in pixels";
    }
    find_lines(header, slice, columns);
    const auto nx = header.find("nx"), ny = header.find("ny"), nz = header.find("nz");
    if (nx && ny && nz && columns.line.empty()) columns.normal = {*nx, *ny, *nz};
    return columns;
}

// ---------------------------------------------------------------------------------------------- lines of marks

struct Line {
    std::string name;
    std::string shape;
    std::vector<Vec3> points;
    std::vector<double> places;  ///< vertex-index of each, where the file has one
};

/// The marks in the order of their places.
void sort_by_place(Line& line) {
    if (line.places.size() != line.points.size()) return;
    std::vector<std::size_t> order(line.points.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return line.places[a] < line.places[b]; });
    std::vector<Vec3> sorted;
    sorted.reserve(order.size());
    for (const std::size_t n : order) sorted.push_back(line.points[n]);
    line.points = std::move(sorted);
}

/// The ellipse inside a box that is given by its four corners.
std::vector<Vec3> ellipse_in(const std::vector<Vec3>& corners) {
    Vec3 centre, u, v;
    for (int a = 0; a < 3; ++a) {
        centre[a] = 0.25 * (corners[0][a] + corners[1][a] + corners[2][a] + corners[3][a]);
        u[a] = 0.5 * (corners[1][a] - corners[0][a]);
        v[a] = 0.5 * (corners[3][a] - corners[0][a]);
    }
    return ellipse(centre, u, v);
}

void append(PointTable& table, const std::string& path, Line& line, const Columns& columns) {
    sort_by_place(line);
    bool closed = columns.closed;
    if (line.shape == "ellipse") {
        if (line.points.size() != 4)
            fail(path, "shape " + quote(line.name) + ": expected the 4 corners of an ellipse's box, got " +
                           std::to_string(line.points.size()));
        line.points = ellipse_in(line.points);
    } else if (!line.shape.empty()) {
        closed = line.shape != "path" && line.shape != "line";
    }
    add_line(table, line.points, closed, line.name);
}

/// Gathers the rows of each line, which need not follow each other.
class LineCollector {
public:
    explicit LineCollector(const Columns& columns) : columns_(columns) {}
    void add(const std::string& path, std::size_t number, const std::vector<string_view>& fields, const Vec3& point) {
        std::string key;
        for (const std::size_t column : columns_.line) key.append(fields[column]) += '\n';
        const auto [place, is_new] = index_.try_emplace(key, lines_.size());
        if (is_new) lines_.push_back({std::string(fields[columns_.line.back()]), {}, {}, {}});
        Line& line = lines_[place->second];
        if (columns_.shape && line.shape.empty()) line.shape = lower(fields[*columns_.shape]);
        if (columns_.vertex) line.places.push_back(to_coordinate(path, number, fields[*columns_.vertex]));
        line.points.push_back(point);
    }
    void finish(const std::string& path, PointTable& table) {
        for (Line& line : lines_) append(table, path, line, columns_);
    }

private:
    const Columns& columns_;
    std::map<std::string, std::size_t> index_;
    std::vector<Line> lines_;
};

// ---------------------------------------------------------------------------------------------- rows

char guess_delimiter(string_view line, bool blanks_only) {
    if (line.find(';') != string_view::npos) return ';';
    if (!blanks_only && line.find('\t') != string_view::npos) return '\t';
    return line.find(',') != string_view::npos ? ',' : ' ';
}

/// A coordinate, with a decimal comma where semicolons part the columns.
double read_coordinate(const std::string& path, std::size_t number, string_view field, char delimiter) {
    if (delimiter != ';' || field.find(',') == string_view::npos) return to_coordinate(path, number, field);
    std::string decimal(field);
    std::replace(decimal.begin(), decimal.end(), ',', '.');
    return to_coordinate(path, number, decimal);
}

Vec3 read_row(const std::string& path, std::size_t number, const std::vector<string_view>& fields, char delimiter,
              const Columns& columns) {
    Vec3 point;
    for (std::size_t a = 0; a < 3; ++a) point[a] = read_coordinate(path, number, fields[columns.at[a]], delimiter);
    if (columns.slice_from_one) point[2] -= 1;
    return point;
}

/// As it stands there; 0 where it is no direction.
Vec3 read_normal(const std::vector<string_view>& fields, const std::array<std::size_t, 3>& at) {
    Vec3 normal{0, 0, 0};
    for (std::size_t a = 0; a < 3; ++a) {
        if (at[a] >= fields.size()) return {0, 0, 0};
        normal[a] = to_number(fields[at[a]]).value_or(0);
    }
    return std::isfinite(normal[0] + normal[1] + normal[2]) ? normal : Vec3{0, 0, 0};
}

/// Columns without names may hold colours, too.
bool are_unit_vectors(const std::vector<Vec3>& all) {
    constexpr double kTolerance = 0.02;  // two decimals
    return std::all_of(all.begin(), all.end(), [](const Vec3& n) {
        const double length = std::hypot(n[0], n[1], n[2]);
        return length == 0 || std::abs(length - 1) < kTolerance;
    });
}

}  // namespace

PointTable parse_columns(const std::string& path, const std::string& text, bool blanks_only) {
    PointTable table;
    table.points.reserve(text.size() / 24);
    Lines lines(text);
    string_view line;
    std::vector<string_view> fields;
    char delimiter = 0;
    Columns columns;
    LineCollector collector(columns);
    std::size_t needed = 0;
    while (lines.next_untrimmed(line)) {
        line = line.substr(0, line.find('#'));
        const string_view trimmed = trim(line);
        if (trimmed.empty() || trimmed.substr(0, 2) == "//") continue;
        const bool first = delimiter == 0;
        if (first) delimiter = guess_delimiter(trimmed, blanks_only);
        split(delimiter == '\t' ? line : trimmed, delimiter, fields);
        line = trimmed;
        if (first) {
            std::optional<Columns> found;
            const bool has_number =
                std::any_of(fields.begin(), fields.end(), [](string_view f) { return to_number(f).has_value(); });
            if (!has_number) found = find_columns(fields);
            if (found) columns = *found;
            needed = columns.count();
            if (found) continue;
            // .pts begins with the number of points
            if (blanks_only && fields.size() == 1 && has_number) {
                delimiter = 0;
                continue;
            }
            if (!has_number && fields.size() >= 3)
                fail(path, lines.number(), "expected columns named x, y, z or three numbers, got " + quote(line));
            columns.rule = fields.size() > 3
                               ? "the first three of " + std::to_string(fields.size()) + " columns without names"
                               : "three columns without names";
            if (fields.size() == 6) columns.normal = {3, 4, 5};
            columns.normal_is_guess = columns.normal.has_value();
        }
        if (fields.size() < needed)
            fail(path, lines.number(),
                 "expected " + std::to_string(needed) + (needed == 3 ? " numbers" : " columns") + ", got " +
                     std::to_string(fields.size()) + " in " + quote(line));
        const Vec3 point = read_row(path, lines.number(), fields, delimiter, columns);
        if (columns.normal) table.normals.push_back(read_normal(fields, *columns.normal));
        if (columns.line.empty())
            table.points.push_back(point);
        else
            collector.add(path, lines.number(), fields, point);
    }
    collector.finish(path, table);
    if (columns.normal_is_guess && !are_unit_vectors(table.normals)) table.normals.clear();
    for (Vec3& n : table.normals) n = normal_of(n);
    table.space = columns.space;
    table.order = columns.order;
    table.rule = columns.rule;
    return table;
}

}  // namespace covol::detail
