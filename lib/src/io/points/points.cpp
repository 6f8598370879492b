#include "covol/points.h"

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <sstream>

#include "base/file.h"
#include "covol/error.h"
#include "covol/file_set.h"
#include "covol/point_structures.h"
#include "covol/points_text.h"
#include "image/to_world.h"
#include "io/points/point_files.h"
#include "io/points/point_formats.h"
#include "io/points/point_reading.h"
#include "io/points/point_text.h"

namespace covol {
namespace {

// ---------------------------------------------------------------------------------------------- reading

template <typename T>
T first_stated(T options, T file, T otherwise) {
    if (options != T::Unstated) return options;
    return file != T::Unstated ? file : otherwise;
}

// ---------------------------------------------------------------------------------------------- writing

void append_number(std::string& text, double value) {
    std::array<char, 32> digits;
    text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
}

void append_row(std::string& text, const Vec3& p, char separator) {
    append_number(text, p[0]);
    text += separator;
    append_number(text, p[1]);
    text += separator;
    append_number(text, p[2]);
    text += '\n';
}

/// The comment with `prefix` before each of its lines.
std::string comment_lines(const std::string& comment, const std::string& prefix) {
    std::string text;
    std::istringstream lines(comment);
    for (std::string line; std::getline(lines, line);) text += prefix + line + "\n";
    return text;
}

std::string to_ply(const std::vector<Vec3>& points, const std::string& comment) {
    std::string text = std::string("ply\nformat ") +
                       (std::endian::native == std::endian::little ? "binary_little_endian" : "binary_big_endian") +
                       " 1.0\n" + comment_lines(comment, "comment ") + "element vertex " +
                       std::to_string(points.size()) +
                       "\nproperty double x\nproperty double y\nproperty double z\nend_header\n";
    text.append(reinterpret_cast<const char*>(points.data()), points.size() * sizeof(Vec3));
    return text;
}

/// Splits a table into one table for each structure, with the points and lines that belong to it.
std::vector<detail::PointTable> parts_of(detail::PointTable table) {
    const std::vector<Vec3> points = std::exchange(table.points, {}), normals = std::exchange(table.normals, {});
    const std::vector<MarkKind> kinds = std::exchange(table.kinds, {});
    const std::vector<MarkLine> lines = std::exchange(table.lines, {});
    const std::vector<std::uint32_t> structure = std::exchange(table.structure, {});
    std::vector<detail::PointTable> parts(table.structures.size(), table);
    std::vector<std::size_t> place;  // index of each point among those of its structure
    for (std::size_t n = 0; n < points.size(); ++n) {
        detail::PointTable& part = parts[structure[n]];
        place.push_back(part.points.size());
        part.points.push_back(points[n]);
        if (!normals.empty()) part.normals.push_back(normals[n]);
        if (!kinds.empty()) part.kinds.push_back(kinds[n]);
    }
    for (MarkLine line : lines) {  // all points of a line belong to the same structure
        if (line.begin >= line.end) continue;
        detail::PointTable& part = parts[structure[line.begin]];
        line.end = place[line.begin] + (line.end - line.begin);
        line.begin = place[line.begin];
        part.lines.push_back(line);
    }
    return parts;
}

[[noreturn]] void refuse_nothing(const std::string& path) {
    throw Error(Errc::InvalidInput, path + ": expected at least one point, got none");
}

PointCloud to_cloud(const std::string& path, detail::PointTable table, const ReadPointsOptions& options) {
    if (table.points.empty()) refuse_nothing(path);
    PointCloud cloud;
    cloud.source = path;
    cloud.stated = (options.space != PointSpace::Unstated || table.space != PointSpace::Unstated) &&
                   (options.order != PointOrder::Unstated || table.order != PointOrder::Unstated);
    cloud.reading = {first_stated(options.space, table.space, PointSpace::World),
                     first_stated(options.order, table.order, PointOrder::XYZ), options.scale, options.channels};
    cloud.space = detail::space_after(cloud.reading.space);
    cloud.points = std::move(table.points);
    for (Vec3& p : cloud.points) p = detail::read_as(cloud.reading, p);
    cloud.lines = std::move(table.lines);
    if (cloud.space == PointSpace::World) {
        cloud.normals = std::move(table.normals);
        for (Vec3& n : cloud.normals) n = detail::direction_as(cloud.reading, n);
        if (table.sensor) cloud.sensor = detail::read_as(cloud.reading, *table.sensor);
        if (!cloud.normals.empty()) table.rule += " with normals";
        if (cloud.sensor) table.rule += " seen from a sensor";
    }
    cloud.rule = table.rule + ", as " + detail::describe(cloud.reading);
    // A scale that the user gives has priority over the file's unit.
    const bool has_lengths = cloud.space != PointSpace::Index && !table.unit.empty();
    if (has_lengths && options.scale == 1) {
        cloud.unit = table.unit;
        cloud.rule += "; lengths in " + table.unit;
    } else if (has_lengths) {
        cloud.rule += ", times the given scale, which overrides the file's unit " + table.unit;
    }
    return cloud;
}

KindedPoints with_kinds(const std::string& path, detail::PointTable table, const ReadPointsOptions& options) {
    KindedPoints points;
    points.kinds = std::move(table.kinds);
    if (!points.kinds.empty()) table.rule += " with kinds";
    points.cloud = to_cloud(path, std::move(table), options);
    return points;
}

}  // namespace

PointCloud read_points(const std::string& path, const ReadPointsOptions& options) {
    return read_kinded_points(path, options).cloud;
}

KindedPoints read_kinded_points(const std::string& path, const ReadPointsOptions& options) {
    require_valid(options, "read_points");
    return with_kinds(path, detail::read_point_table(path), options);
}

PointCloud KindedPoints::of(MarkKind kind) const {
    if (kinds.empty() && kind == MarkKind::Surface) return cloud;
    PointCloud some = cloud;
    some.points.clear();
    some.normals.clear();
    some.lines.clear();
    for (std::size_t n = 0; n < kinds.size(); ++n) {
        if (kinds[n] != kind) continue;
        some.points.push_back(cloud.points[n]);
        if (!cloud.normals.empty()) some.normals.push_back(cloud.normals[n]);
    }
    return some;
}

std::vector<StructurePoints> read_structures_of_points(const std::string& path, const std::string& by,
                                                       const ReadPointsOptions& options) {
    require_valid(options, "read_points");
    detail::PointTable table = detail::read_point_table(path, by);
    if (table.points.empty()) refuse_nothing(path);
    const std::vector<std::string> names = table.structures;
    std::vector<detail::PointTable> parts = parts_of(std::move(table));
    std::vector<StructurePoints> structures;
    for (std::size_t n = 0; n < parts.size(); ++n)
        structures.push_back({names[n], with_kinds(path, std::move(parts[n]), options)});
    return structures;
}

PointCloud parse_points(const std::string& text, const std::string& source, const ReadPointsOptions& options) {
    require_valid(options, "read_points");
    if (text.empty()) throw Error(Errc::InvalidInput, source + ": expected points, got nothing");
    return to_cloud(source, detail::parse_columns(source, detail::to_utf8(text), true), options);
}

void write_points(const std::string& path, const std::vector<Vec3>& points, const std::string& comment) {
    const std::string extension = detail::extension(path);
    std::string text;
    if (extension == ".ply") {
        text = to_ply(points, comment);
    } else if (extension == ".xyz" || extension == ".csv") {
        const bool csv = extension == ".csv";
        text = comment_lines(comment, "# ") + (csv ? "x,y,z\n" : "");
        for (const Vec3& p : points) append_row(text, p, csv ? ',' : ' ');
    } else {
        throw Error(Errc::InvalidOptions,
                    path + ": expected a name ending in .xyz, .csv or .ply, got '" + extension + "'");
    }
    write_text_file(path, text);
}

}  // namespace covol
