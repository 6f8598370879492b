#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "covol/error.h"
#include "io/points/bytes.h"
#include "io/points/point_formats.h"
#include "io/points/point_text.h"

namespace covol::detail {
namespace {

using std::string_view;

Vec3 first_three(const std::string& path, std::size_t line, const std::vector<string_view>& fields, std::size_t from) {
    if (fields.size() < from + 3)
        fail(path, line, "expected 3 numbers, got " + std::to_string(fields.size() - std::min(from, fields.size())));
    Vec3 point;
    for (std::size_t a = 0; a < 3; ++a) point[a] = to_coordinate(path, line, fields[from + a]);
    return point;
}

// ---------------------------------------------------------------------------------------------- PLY

enum class PlyFormat { Ascii, LittleEndian, BigEndian };
enum class PlyType { Int8, UInt8, Int16, UInt16, Int32, UInt32, Float, Double };

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::Float;
    bool is_list = false;
    PlyType count_type = PlyType::UInt8;
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties;

    [[nodiscard]] bool has_list() const {
        return std::any_of(properties.begin(), properties.end(), [](const PlyProperty& p) { return p.is_list; });
    }
};

struct PlyHeader {
    PlyFormat format = PlyFormat::Ascii;
    std::vector<PlyElement> elements;
};

std::optional<PlyType> ply_type(string_view name) {
    constexpr std::pair<const char*, PlyType> kNames[] = {
        {"char", PlyType::Int8},     {"int8", PlyType::Int8},     {"uchar", PlyType::UInt8},
        {"uint8", PlyType::UInt8},   {"short", PlyType::Int16},   {"int16", PlyType::Int16},
        {"ushort", PlyType::UInt16}, {"uint16", PlyType::UInt16}, {"int", PlyType::Int32},
        {"int32", PlyType::Int32},   {"uint", PlyType::UInt32},   {"uint32", PlyType::UInt32},
        {"float", PlyType::Float},   {"float32", PlyType::Float}, {"double", PlyType::Double},
        {"float64", PlyType::Double}};
    for (const auto& [known, type] : kNames)
        if (name == known) return type;
    return std::nullopt;
}

std::uint64_t ply_bytes(PlyType type) {
    switch (type) {
        case PlyType::Int8:
        case PlyType::UInt8: return 1;
        case PlyType::Int16:
        case PlyType::UInt16: return 2;
        case PlyType::Double: return 8;
        default: return 4;
    }
}

double ply_value(const char* data, PlyType type, bool swap) {
    switch (type) {
        case PlyType::Int8: return load<std::int8_t>(data, swap);
        case PlyType::UInt8: return load<std::uint8_t>(data, swap);
        case PlyType::Int16: return load<std::int16_t>(data, swap);
        case PlyType::UInt16: return load<std::uint16_t>(data, swap);
        case PlyType::Int32: return load<std::int32_t>(data, swap);
        case PlyType::UInt32: return load<std::uint32_t>(data, swap);
        case PlyType::Float: return load<float>(data, swap);
        case PlyType::Double: break;
    }
    return load<double>(data, swap);
}

PlyHeader read_ply_header(const std::string& path, Lines& lines) {
    PlyHeader header;
    string_view line;
    if (!lines.next(line) || line != "ply") fail(path, 1, "expected 'ply', got " + quote(line));
    std::vector<string_view> fields;
    bool has_format = false;
    while (lines.next(line)) {
        split(line, ' ', fields);
        const auto malformed = [&] { fail(path, lines.number(), "not a PLY header line: " + quote(line)); };
        if (fields.empty() || fields[0] == "comment" || fields[0] == "obj_info") continue;
        if (fields[0] == "end_header") {
            if (!has_format) fail(path, lines.number(), "the header states no format");
            return header;
        }
        if (fields[0] == "format" && fields.size() >= 2) {
            has_format = true;
            if (fields[1] == "ascii")
                header.format = PlyFormat::Ascii;
            else if (fields[1] == "binary_little_endian")
                header.format = PlyFormat::LittleEndian;
            else if (fields[1] == "binary_big_endian")
                header.format = PlyFormat::BigEndian;
            else
                malformed();
        } else if (fields[0] == "element" && fields.size() == 3) {
            PlyElement element;
            element.name = fields[1];
            const auto [end, status] =
                std::from_chars(fields[2].data(), fields[2].data() + fields[2].size(), element.count);
            if (status != std::errc() || end != fields[2].data() + fields[2].size()) malformed();
            header.elements.push_back(element);
        } else if (fields[0] == "property" && !header.elements.empty()) {
            PlyProperty property;
            property.is_list = fields.size() == 5 && fields[1] == "list";
            if (!property.is_list && fields.size() != 3) malformed();
            const auto type = ply_type(fields[fields.size() - 2]);
            const auto count_type = property.is_list ? ply_type(fields[2]) : PlyType::UInt8;
            if (!type || !count_type) malformed();
            property.name = lower(fields.back());
            property.type = *type;
            property.count_type = *count_type;
            header.elements.back().properties.push_back(property);
        } else {
            malformed();
        }
    }
    fail(path, lines.number(), "the header has no end_header; the file is truncated");
}

/// Walks over the values of one binary element. Returns how many bytes they take; 0 when they go beyond `size`
/// (an element without properties is never asked for). place[p] is where property p begins.
std::uint64_t measure_ply(const PlyElement& element, const char* data, std::uint64_t size, bool swap,
                          std::vector<std::uint64_t>& place) {
    std::uint64_t at = 0;
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        place[p] = at;
        std::uint64_t bytes = ply_bytes(property.type);
        if (property.is_list) {
            const std::uint64_t count_bytes = ply_bytes(property.count_type);
            if (count_bytes > size - at) return 0;
            const double count = ply_value(data + at, property.count_type, swap);
            at += count_bytes;
            if (!(count >= 0) || count * double(bytes) > double(size - at)) return 0;
            bytes *= static_cast<std::uint64_t>(count);
        }
        if (bytes > size - at) return 0;
        at += bytes;
    }
    return at;
}

/// The places of x, y, z among the properties, and of nx, ny, nz where there are all three; of what is no vertex, none.
std::vector<std::size_t> ply_columns(const std::string& path, const PlyElement& element) {
    std::vector<std::size_t> at;
    if (element.name != "vertex") return at;
    for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) {
        const auto found = std::find_if(element.properties.begin(), element.properties.end(),
                                        [&](const PlyProperty& p) { return p.name == name && !p.is_list; });
        if (found != element.properties.end())
            at.push_back(static_cast<std::size_t>(found - element.properties.begin()));
        else if (at.size() < 3)
            fail(path, std::string("expected a vertex property '") + name + "', got none");
        else
            break;
    }
    if (at.size() < 6) at.resize(3);
    return at;
}

/// A vertex's values, of the columns that ply_columns() found.
void add_vertex(const std::vector<double>& values, PointTable& table) {
    table.points.push_back({values[0], values[1], values[2]});
    if (values.size() == 6) table.normals.push_back(normal_of({values[3], values[4], values[5]}));
}

void read_ply_ascii(const std::string& path, const PlyHeader& header, Lines& lines, PointTable& table) {
    string_view line;
    std::vector<string_view> fields;
    std::vector<double> values;
    for (const PlyElement& element : header.elements) {
        const std::vector<std::size_t> at = ply_columns(path, element);
        values.resize(at.size());
        if (element.properties.empty()) continue;
        // a line takes at least a digit and its end for each property
        if (element.count > lines.rest().size() / 2 + 1)
            fail(path, lines.number(),
                 "expected " + std::to_string(element.count) + " elements '" + element.name +
                     "', the file is too short for them; it is truncated");
        if (!at.empty()) table.points.reserve(element.count);
        for (std::uint64_t n = 0; n < element.count;) {
            if (!lines.next(line))
                fail(path, lines.number(),
                     "expected " + std::to_string(element.count) + " elements '" + element.name + "', got " +
                         std::to_string(n) + "; the file is truncated");
            if (line.empty()) continue;
            ++n;
            split(line, ' ', fields);
            std::vector<std::size_t> column = at;
            if (element.has_list()) {
                // lists before a coordinate shift it
                std::size_t field = 0;
                for (std::size_t p = 0; p < element.properties.size() && field < fields.size(); ++p) {
                    for (std::size_t a = 0; a < at.size(); ++a)
                        if (at[a] == p) column[a] = field;
                    const double length =
                        element.properties[p].is_list ? to_coordinate(path, lines.number(), fields[field]) : 0;
                    field += 1 + static_cast<std::size_t>(std::clamp(length, 0.0, double(fields.size())));
                }
                if (field > fields.size() && n == element.count)
                    fail(path, lines.number(), "the last of " + std::to_string(element.count) + " elements '" + element.name +
                                                   "' ends early; the file is truncated");
            }
            if (at.empty()) continue;
            for (std::size_t a = 0; a < at.size(); ++a) {
                if (column[a] >= fields.size())
                    fail(path, lines.number(),
                         "expected " + std::to_string(element.properties.size()) + " numbers, got " +
                             std::to_string(fields.size()));
                const string_view field = fields[column[a]];
                values[a] = a < 3 ? to_coordinate(path, lines.number(), field) : to_number(field).value_or(0);
            }
            add_vertex(values, table);
        }
    }
}

void read_ply_binary(const std::string& path, const PlyHeader& header, string_view data, PointTable& table) {
    const bool swap = (header.format == PlyFormat::BigEndian) != (std::endian::native == std::endian::big);
    std::vector<double> values;
    for (const PlyElement& element : header.elements) {
        const std::vector<std::size_t> at = ply_columns(path, element);
        values.resize(at.size());
        if (element.properties.empty()) continue;
        if (element.count > data.size())
            fail(path, "expected " + std::to_string(element.count) + " elements '" + element.name + "', the file has " +
                           std::to_string(data.size()) + " bytes left for them; it is truncated");
        if (!at.empty()) table.points.reserve(element.count);
        std::vector<std::uint64_t> place(element.properties.size());
        for (std::uint64_t n = 0; n < element.count; ++n) {
            const std::uint64_t bytes = measure_ply(element, data.data(), data.size(), swap, place);
            if (bytes == 0)
                fail(path, "expected " + std::to_string(element.count) + " elements '" + element.name + "', got " +
                               std::to_string(n) + "; the file is truncated");
            if (!at.empty()) {
                for (std::size_t a = 0; a < at.size(); ++a)
                    values[a] = ply_value(data.data() + place[at[a]], element.properties[at[a]].type, swap);
                if (!std::isfinite(values[0] + values[1] + values[2]))
                    fail(path, "vertex " + std::to_string(n) + ": expected finite numbers, got NaN or infinity");
                add_vertex(values, table);
            }
            data.remove_prefix(bytes);
        }
    }
}

/// Whether a face of an OBJ gives a vertex another normal than the one of the same number.
bool mixes_normals(const std::vector<string_view>& fields) {
    return std::any_of(fields.begin() + 1, fields.end(), [](string_view corner) {
        const std::size_t first = corner.find('/'), last = corner.rfind('/');
        return first != last && corner.substr(0, first) != corner.substr(last + 1);
    });
}

}  // namespace

PointTable parse_obj(const std::string& path, const std::string& text) {
    PointTable table;
    table.rule = "vertices of an OBJ";
    Lines lines(text);
    string_view line;
    std::vector<string_view> fields;
    bool by_number = true;
    while (lines.next(line)) {
        split(line, ' ', fields);
        if (fields.empty()) continue;
        if (fields[0] == "v") table.points.push_back(first_three(path, lines.number(), fields, 1));
        if (fields[0] == "vn") {
            Vec3 normal{0, 0, 0};
            for (std::size_t a = 0; a < 3 && fields.size() >= 4; ++a) normal[a] = to_number(fields[a + 1]).value_or(0);
            table.normals.push_back(normal_of(normal));
        }
        if (fields[0] == "f") by_number = by_number && !mixes_normals(fields);
    }
    if (!by_number || table.normals.size() != table.points.size()) table.normals.clear();
    return table;
}

PointTable parse_off(const std::string& path, const std::string& text) {
    PointTable table;
    table.rule = "vertices of an OFF";
    Lines lines(text);
    string_view line;
    std::vector<string_view> fields;
    const auto next_fields = [&] { return lines.next_words(line, fields); };
    if (!next_fields()) fail(path, "expected a point, got none");
    // OFF, COFF, NOFF, STOFF, ...; the counts may follow on the same line
    const std::string magic = lower(fields[0]);
    if (magic.size() < 3 || magic.substr(magic.size() - 3) != "off")
        fail(path, lines.number(), "expected OFF, got " + quote(line));
    if (magic.find('4') != std::string::npos || magic.find("noff") == 1)
        throw Error(Errc::Unsupported, "read_points: " + path + ": expected three coordinates, got " + quote(line));
    fields.erase(fields.begin());
    if (!fields.empty() && lower(fields[0]) == "binary")
        throw Error(Errc::Unsupported, "read_points: " + path + ": expected an ascii OFF, got a binary one");
    if (fields.empty() && !next_fields()) fail(path, lines.number(), "expected the number of vertices, got the end");
    const double count = to_coordinate(path, lines.number(), fields[0]);
    constexpr double kFewestBytes = 6;  // "0 0 0\n"
    if (!(count >= 0) || count != std::floor(count) || count * kFewestBytes > double(text.size()) + kFewestBytes)
        fail(path, lines.number(), "a file of this size cannot hold " + quote(fields[0]) + " vertices");
    const auto vertices = static_cast<std::size_t>(count);
    table.points.reserve(vertices);
    while (table.points.size() < vertices) {
        if (!next_fields())
            fail(path, lines.number(),
                 "expected " + std::to_string(vertices) + " vertices, got " + std::to_string(table.points.size()) +
                     "; the file is truncated");
        table.points.push_back(first_three(path, lines.number(), fields, 0));
    }
    return table;
}

PointTable parse_ply(const std::string& path, const std::string& text) {
    Lines lines(text);
    const PlyHeader header = read_ply_header(path, lines);
    if (std::none_of(header.elements.begin(), header.elements.end(),
                     [](const PlyElement& e) { return e.name == "vertex"; }))
        fail(path, "expected an element 'vertex', got none");
    PointTable table;
    table.rule = "vertices of a PLY";
    if (header.format == PlyFormat::Ascii)
        read_ply_ascii(path, header, lines, table);
    else
        read_ply_binary(path, header, lines.rest(), table);
    return table;
}

}  // namespace covol::detail
