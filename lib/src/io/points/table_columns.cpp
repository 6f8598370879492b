#include "io/points/table_columns.h"

#include <cstring>
#include <map>

#include "base/text.h"
#include "io/points/point_text.h"

namespace covol::detail {

using std::string_view;

ColumnName parse_name(string_view text) {
    std::string name = lower(trim(text));
    for (const char* prefix : {"position ", "position_", "pos ", "pos_", "coord_", "point_", "centroid ", "centroid_",
                               "center ", "center_", "centre ", "location ", "location_", "//"})
        if (name.rfind(prefix, 0) == 0) name.erase(0, std::strlen(prefix));
    const std::size_t cut = name.find_first_of(" ([_/");
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

namespace {

/// Finds the columns of a header by their names. If several columns have the same name, the first is found.
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
    /// The unit of length at the end of a column's name. "m" and "in" count only in brackets or after a slash,
    /// because "x_m" may be a mean, and "x in" an input.
    [[nodiscard]] std::string length_unit(const std::string& name) const {
        const auto found = units_.find(name);
        if (found == units_.end()) return {};
        const string_view field = fields_[columns_.at(name)];
        const bool in_brackets = field.find_first_of("([/") != string_view::npos;
        if (!in_brackets && (found->second == "m" || found->second == "in")) return {};
        return unit_of_length(found->second);
    }
    /// A text with the names of columns as in the file: "columns X, Y, Z".
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

/// Recognizes tables of napari's points and shapes, whose columns are named axis-0, axis-1, ...: the last three axes
/// are z, y, x in voxels. @returns nothing if there are fewer than three such columns
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
    if (axes.size() > 3) columns.rule += ", the axes before them (time, channel) ignored";
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

}  // namespace

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
        columns.order = PointOrder::XYZ;  // the columns have names, so their order is known
        if (slices) columns.rule += ", slices from 0";
    } else if (slices) {
        // Fiji's Results tables: slices count from 1; X and Y are in the unit of the image, if it has one.
        columns.space = PointSpace::Slices;
        columns.order = PointOrder::XYZ;
        columns.slice_from_one = true;
        columns.rule += " of Fiji Results, slices from 1, X and Y taken in the image's unit, not in pixels";
    }
    if (!in_voxels) {
        columns.unit = {header.length_unit("x"), header.length_unit("y"), slices ? "" : header.length_unit("z")};
        columns.row_unit = header.find("unit") ? header.find("unit") : header.find("units");
    }
    find_lines(header, slice, columns);
    if (columns.line.empty()) columns.kind = header.find("kind");
    const auto nx = header.find("nx"), ny = header.find("ny"), nz = header.find("nz");
    if (nx && ny && nz && columns.line.empty()) columns.normal = {*nx, *ny, *nz};
    return columns;
}

}  // namespace covol::detail
