#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>
#include <optional>

#include "covol/error.h"
#include "io/pixels/raw_image.h"
#include "io/points/point_formats.h"
#include "io/points/point_text.h"
#include "io/points/table_columns.h"

namespace covol::detail {
namespace {

using std::string_view;

// ---------------------------------------------------------------------------------------------- lines of marks

struct Line {
    std::string name;
    std::string shape;
    std::vector<Vec3> points;
    /// The number in the column vertex-index for each point, which is its place in the line; empty if the file has no
    /// such column.
    std::vector<double> places;
    std::string structure;  ///< name of the structure; empty if no column states it
};

/// Sorts the marks of a line by their numbers in the column vertex-index, if the file has this column.
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

/// Points on the ellipse that is inscribed in a rectangle. napari stores an ellipse as the four corners of this
/// rectangle.
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
    if (columns.structure) name_structure(table, path, line.structure);
}

/// Collects the points of each line of marks; their rows need not be consecutive.
class LineCollector {
public:
    explicit LineCollector(const Columns& columns) : columns_(columns) {}
    void add(const std::string& path, std::size_t number, const std::vector<string_view>& fields, const Vec3& point) {
        std::string key;
        for (const std::size_t column : columns_.line) key.append(fields[column]) += '\n';
        const std::string structure(columns_.structure ? fields[*columns_.structure] : string_view());
        key += structure;
        const auto [place, is_new] = index_.try_emplace(key, lines_.size());
        if (is_new) lines_.push_back({std::string(fields[columns_.line.back()]), {}, {}, {}, structure});
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

/// A coordinate, with a decimal point or a decimal comma.
double read_coordinate(const std::string& path, std::size_t number, string_view field) {
    if (const auto value = table_number(field); value && std::isfinite(*value)) return *value;
    return to_coordinate(path, number, field);
}

Vec3 read_row(const std::string& path, std::size_t number, const std::vector<string_view>& fields,
              const Columns& columns) {
    Vec3 point;
    for (std::size_t a = 0; a < 3; ++a) point[a] = read_coordinate(path, number, fields[columns.at[a]]);
    if (columns.slice_from_one) point[2] -= 1;
    return point;
}

/// A normal of any length; {0, 0, 0} if the fields do not define a direction.
Vec3 read_normal(const std::vector<string_view>& fields, const std::array<std::size_t, 3>& at) {
    Vec3 normal{0, 0, 0};
    for (std::size_t a = 0; a < 3; ++a) {
        if (at[a] >= fields.size()) return {0, 0, 0};
        normal[a] = table_number(fields[at[a]]).value_or(0);
    }
    return std::isfinite(normal[0] + normal[1] + normal[2]) ? normal : Vec3{0, 0, 0};
}

/// The kind of a mark; nothing if the field is not the name of a kind.
std::optional<MarkKind> read_kind(const std::vector<string_view>& fields, std::size_t column) {
    if (column >= fields.size()) return std::nullopt;
    const std::string word = lower(trim(fields[column]));
    for (std::size_t n = 0; n < kWords<MarkKind>.size(); ++n)
        if (word == kWords<MarkKind>[n]) return MarkKind(n);
    return std::nullopt;
}

/// Whether all vectors have the length 1 or 0. In columns without names, such vectors are taken as normals; other
/// numbers may be colours.
bool are_unit_vectors(const std::vector<Vec3>& all) {
    constexpr double kTolerance = 0.02;  // allows for normals that are written with two decimals
    return std::all_of(all.begin(), all.end(), [](const Vec3& n) {
        const double length = std::hypot(n[0], n[1], n[2]);
        return length == 0 || std::abs(length - 1) < kTolerance;
    });
}

/// Converts coordinates to a common unit: the first unit that the header or, if it states none, a row states.
class RowUnits {
public:
    explicit RowUnits(const Columns& columns) : columns_(columns) {
        for (const std::string& unit : columns.unit)
            if (common_.empty()) common_ = unit;
    }
    void apply(const std::vector<string_view>& fields, Vec3& point) {
        if (columns_.row_unit) {
            const std::string own = unit_of_length(fields[*columns_.row_unit]);
            if (common_.empty()) common_ = own;
            for (double& x : point) x *= factor(own);
            return;
        }
        for (std::size_t a = 0; a < 3; ++a) point[a] *= factor(columns_.unit[a]);
    }
    [[nodiscard]] const std::string& common() const { return common_; }

private:
    [[nodiscard]] double factor(const std::string& unit) const {
        return unit.empty() || unit == common_ ? 1 : unit_in_metres(unit) / unit_in_metres(common_);
    }

    const Columns& columns_;
    std::string common_;
};

/// Finds the beginning of a table and its delimiter. The table begins after an optional title, at a header that names
/// x, y and z, or at the first row of numbers.
class TableBegin {
public:
    TableBegin(std::string path, bool counted, std::string structures_by)
        : path_(std::move(path)), structures_by_(std::move(structures_by)), counted_(counted) {}

    /// @returns whether the line is the header or the first row of numbers; `fields` then holds the fields of the line.
    bool take(std::size_t number, string_view line, std::vector<string_view>& fields) {
        const string_view trimmed = trim(line);
        if (lower(trimmed.substr(0, 4)) == "sep=") return false;  // Excel states the delimiter in this line
        for (const bool named : {true, false})
            for (const char candidate : named ? kDelimitersOfNames : kDelimitersOfNumbers) {
                if (candidate != ' ' && trimmed.find(candidate) == string_view::npos) continue;
                split(candidate == '\t' ? line : trimmed, candidate, fields);
                if (named ? !name_columns(fields) : !begins_with_numbers(fields)) continue;
                if (!named) count_columns(fields);
                delimiter = candidate;
                return true;
            }
        note(number, trimmed, fields);
        return false;
    }
    /// @throws Error InvalidInput with the reason why the first line that is neither a header nor a row of numbers was
    /// not accepted
    [[noreturn]] void refuse() const { fail(path_, line_, why_.empty() ? "expected points, got none" : why_); }
    [[nodiscard]] bool has_title() const { return title_ > 0; }

    char delimiter = 0;
    Columns columns;
    bool is_header = false;
    std::size_t needed = 3;

private:
    bool name_columns(const std::vector<string_view>& fields) {
        if (std::any_of(fields.begin(), fields.end(), [](string_view f) { return table_number(f).has_value(); }))
            return false;
        const std::optional<Columns> found = find_columns(fields);
        if (!found) return false;
        columns = *found;
        is_header = true;
        find_structures(fields);
        needed = columns.count();
        report_title();
        return true;
    }
    void find_structures(const std::vector<string_view>& fields) {
        if (structures_by_.empty()) return;
        std::string names;
        for (std::size_t n = 0; n < fields.size(); ++n) {
            if (lower(trim(fields[n])) == lower(structures_by_)) columns.structure = n;
            names += (n == 0 ? "" : ", ") + std::string(trim(fields[n]));
        }
        if (!columns.structure)
            throw Error(
                Errc::InvalidInput,
                path_ + ": `structure_column`: expected one of the columns " + names + ", got " + quote(structures_by_),
                "structure_column");
        columns.rule += ", structures by " + structures_by_;
    }
    void count_columns(const std::vector<string_view>& fields) {
        if (is_table_without_names_) fail(path_, line_, why_);
        columns.rule = fields.size() > 3
                           ? "the first three of " + std::to_string(fields.size()) + " columns without names"
                           : "three columns without names";
        if (fields.size() == 6) columns.normal = {3, 4, 5};
        columns.normal_is_assumed = columns.normal.has_value();
        if (title_ > 0 && !is_word_only_) fail(path_, line_, why_);
        report_title();
    }
    void report_title() {
        if (title_ > 0)
            columns.rule += ", below " + std::to_string(title_) + (title_ > 1 ? " lines" : " line") + " of title";
    }
    /// Records a line that is neither the header nor a row of numbers, as a title, and as the reason for an error if no
    /// table follows.
    void note(std::size_t number, string_view line, const std::vector<string_view>& fields_) {
        constexpr std::size_t kMaxTitle = 100;
        std::vector<string_view> fields = fields_;
        for (const char candidate : kDelimitersOfNames.substr(0, 3))
            if (line.find(candidate) != string_view::npos) {
                split(line, candidate, fields);
                break;
            }
        const bool has_number =
            std::any_of(fields.begin(), fields.end(), [](string_view f) { return table_number(f).has_value(); });
        // In formats such as .pts, the number of points may precede the table. This line is not a title.
        if (counted_ && fields.size() == 1 && has_number && title_ == 0) return;
        if (why_.empty()) {
            line_ = number;
            why_ =
                !has_number && fields.size() >= 3
                    ? "expected columns named x, y, z or three numbers, got " + quote(line)
                : fields.size() < 3
                    ? "expected 3 numbers, got " + std::to_string(fields.size()) + " in " + quote(line)
                    : "expected a number, got " + quote(*std::find_if(fields.begin(), fields.end(),
                                                                      [](string_view f) { return !table_number(f); }));
        }
        is_table_without_names_ = is_table_without_names_ || (!has_number && fields.size() >= 3);
        is_word_only_ = is_word_only_ && !has_number;
        if (++title_ > kMaxTitle) refuse();
    }

    std::string path_, structures_by_, why_;
    bool counted_;  ///< whether a line with the number of points may precede the table
    bool is_table_without_names_ = false, is_word_only_ = true;
    std::size_t line_ = 1, title_ = 0;
};

/// Whether a row after the header is not data but repeats names or states units. TrackMate writes three such rows.
/// Stores units in `columns`.
bool continues_header(const std::vector<string_view>& fields, Columns& columns) {
    std::array<std::string, 3> units;
    for (std::size_t a = 0; a < 3; ++a) {
        const string_view field = fields[columns.at[a]];
        const std::string text = lower(field), name = parse_name(field).name;
        constexpr std::array<string_view, 3> kNames{"x", "y", "z"};
        units[a] = unit_of_length(field);
        const bool in_brackets = field.size() > 1 && (field.front() == '(' || field.front() == '[');
        if (!field.empty() && name != kNames[a] && units[a].empty() && !in_brackets && !means_voxels(text))
            return false;
    }
    for (std::size_t a = 0; a < 3; ++a)
        if (columns.unit[a].empty()) columns.unit[a] = units[a];
    return true;
}

}  // namespace

PointTable parse_columns(const std::string& path, const std::string& text, bool blanks_only,
                         const std::string& structures_by) {
    PointTable table;
    table.points.reserve(text.size() / 24);
    Lines lines(text);
    string_view line;
    std::vector<string_view> fields;
    TableBegin begin(path, blanks_only, structures_by);
    Columns& columns = begin.columns;
    std::optional<LineCollector> collector;
    std::optional<RowUnits> units;
    while (lines.next_untrimmed(line)) {
        line = line.substr(0, line.find('#'));
        const string_view trimmed = trim(line);
        if (trimmed.empty() || trimmed.substr(0, 2) == "//") continue;
        if (begin.delimiter == 0) {
            if (!begin.take(lines.number(), line, fields) || begin.is_header) continue;
        } else {
            split(begin.delimiter == '\t' ? line : trimmed, begin.delimiter, fields);
        }
        line = trimmed;
        if (fields.size() < begin.needed)
            fail(path, lines.number(),
                 "expected " + std::to_string(begin.needed) + (begin.needed == 3 ? " numbers" : " columns") + ", got " +
                     std::to_string(fields.size()) + " in " + quote(line));
        if (!units) {
            if (begin.is_header && continues_header(fields, columns)) continue;
            units.emplace(columns);
            collector.emplace(columns);
        }
        Vec3 point = read_row(path, lines.number(), fields, columns);
        units->apply(fields, point);
        if (columns.kind) {
            const std::optional<MarkKind> kind = read_kind(fields, *columns.kind);
            // A value that is no kind of mark shows that the column "kind" has another meaning in this file.
            if (!kind) {
                columns.kind.reset();
                table.kinds.clear();
            } else {
                table.kinds.push_back(*kind);
            }
        }
        if (columns.normal) table.normals.push_back(read_normal(fields, *columns.normal));
        if (columns.structure && trim(fields[*columns.structure]).empty())
            fail(path, lines.number(),
                 "expected a structure's name in the column " + quote(structures_by) + ", got none");
        if (columns.line.empty()) {
            table.points.push_back(point);
            if (columns.structure) name_structure(table, path, std::string(fields[*columns.structure]));
        } else {
            collector->add(path, lines.number(), fields, point);
        }
    }
    if (begin.delimiter == 0 && begin.has_title()) begin.refuse();
    if (collector) collector->finish(path, table);
    if (columns.normal_is_assumed && !are_unit_vectors(table.normals)) table.normals.clear();
    for (Vec3& n : table.normals) n = normal_of(n);
    table.space = columns.space;
    table.order = columns.order;
    if (units) table.unit = units->common();
    table.rule = columns.rule;
    return table;
}

}  // namespace covol::detail
