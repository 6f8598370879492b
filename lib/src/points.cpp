#include "covol/points.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <numeric>
#include <sstream>

#include "covol/error.h"
#include "detail/file.h"
#include "detail/kd_tree.h"
#include "detail/point_files.h"
#include "detail/point_reading.h"

namespace covol {
namespace {

using detail::squared_distance;

// ---------------------------------------------------------------------------------------------- reading

template <typename T>
T first_stated(T options, T file, T otherwise) {
    if (options != T::Unstated) return options;
    return file != T::Unstated ? file : otherwise;
}

// ---------------------------------------------------------------------------------------------- neighbours

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

/// Each line of the comment behind `prefix`.
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

}  // namespace

PointCloud read_points(const std::string& path, const ReadPointsOptions& options) {
    if (!(options.scale > 0) || !std::isfinite(options.scale))
        throw Error(Errc::InvalidOptions, "read_points: scale: expected > 0, got " + std::to_string(options.scale));
    if (options.channels < 1)
        throw Error(Errc::InvalidOptions,
                    "read_points: channels: expected >= 1, got " + std::to_string(options.channels));
    detail::PointTable table = detail::read_point_table(path);
    if (table.points.empty())
        throw Error(Errc::InvalidInput, "read_points: " + path + ": expected at least one point, got none");
    PointCloud cloud;
    cloud.source = path;
    cloud.stated = (options.space != PointSpace::Unstated || table.space != PointSpace::Unstated) &&
                   (options.order != PointOrder::Unstated || table.order != PointOrder::Unstated);
    cloud.reading = {first_stated(options.space, table.space, PointSpace::World),
                     first_stated(options.order, table.order, PointOrder::XYZ), options.scale,
                     options.channels};
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
    return cloud;
}

std::vector<Vec3> to_world(const PointCloud& cloud, const ImageGeometry* geometry) {
    if (cloud.space == PointSpace::World) return cloud.points;
    if (geometry == nullptr)
        throw Error(Errc::InvalidInput, "to_world: " + cloud.source +
                                            ": the points are in an image's own frame, and there is no image; give one, "
                                            "or --points-space world for points in lengths");
    std::vector<Vec3> world;
    world.reserve(cloud.points.size());
    for (const Vec3& p : cloud.points) world.push_back(detail::to_world(cloud.space, p, *geometry));
    return world;
}

std::vector<Vec3> merge_close_points(const std::vector<Vec3>& points, double cell) {
    if (!(cell >= 0) || !std::isfinite(cell))
        throw Error(Errc::InvalidOptions, "merge_close_points: cell: expected >= 0, got " + std::to_string(cell));
    struct Item {
        Vec3 key;  ///< the cell, or the point itself
        std::size_t index;
    };
    std::vector<Item> items(points.size());
    for (std::size_t n = 0; n < points.size(); ++n) {
        items[n] = {points[n], n};
        if (cell > 0)
            for (double& x : items[n].key) x = std::floor(x / cell);
    }
    tbb::parallel_sort(items.begin(), items.end(),
                       [](const Item& a, const Item& b) { return a.key != b.key ? a.key < b.key : a.index < b.index; });
    std::vector<std::uint8_t> keep(points.size(), 0);
    const double least = 0.25 * cell * cell;
    std::vector<std::size_t> kept;  // in the cell at hand; few, for they are at least cell/2 apart
    for (std::size_t n = 0; n < items.size(); ++n) {
        if (n == 0 || items[n].key != items[n - 1].key) kept.clear();
        const Vec3& point = points[items[n].index];
        const bool close = std::any_of(kept.begin(), kept.end(), [&](std::size_t other) {
            const double distance = squared_distance(points[other], point);
            return distance == 0 || distance < least;
        });
        if (close) continue;
        kept.push_back(items[n].index);
        keep[items[n].index] = 1;
    }
    std::vector<Vec3> result;
    for (std::size_t n = 0; n < points.size(); ++n)
        if (keep[n] != 0) result.push_back(points[n]);
    return result;
}

std::vector<std::uint32_t> spatial_order(const std::vector<Vec3>& points, std::size_t most) {
    if (most == 0) throw Error(Errc::InvalidOptions, "spatial_order: most: expected > 0, got 0");
    if (points.size() > std::numeric_limits<std::uint32_t>::max())
        throw Error(Errc::InvalidInput, "spatial_order: expected fewer than 2^32 points, got " + std::to_string(points.size()));
    if (points.empty()) return {};
    constexpr int kBits = 10;
    const WorldBox box = bounding_box(points);
    const double longest = longest_side(box);
    const double scale = longest > 0 ? ((1 << kBits) - 1) / longest : 0.0;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> keyed(points.size());
    tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) {
        std::uint32_t key = 0;
        for (int a = 0; a < 3; ++a) {
            const auto cell = static_cast<std::uint32_t>((points[n][a] - box.min[a]) * scale);
            for (int bit = 0; bit < kBits; ++bit) key |= (cell >> bit & 1U) << (3 * bit + a);
        }
        keyed[n] = {key, static_cast<std::uint32_t>(n)};
    });
    tbb::parallel_sort(keyed.begin(), keyed.end());
    std::vector<std::uint32_t> order(std::min(points.size(), most));
    const double step = double(points.size()) / double(order.size());
    for (std::size_t n = 0; n < order.size(); ++n)
        order[n] = keyed[order.size() < points.size() ? std::size_t((double(n) + 0.5) * step) : n].second;
    return order;
}

SpacingStatistics nearest_neighbour_spacing(const std::vector<Vec3>& points) {
    if (points.size() < 2) return {};
    constexpr std::size_t kQueries = 50000;
    const std::size_t step = (points.size() + kQueries - 1) / kQueries;
    const detail::KdTree tree(points);
    std::vector<double> distances((points.size() + step - 1) / step);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, distances.size(), 256), [&](const auto& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n)
            distances[n] = std::sqrt(tree.nearest_other(points[n * step]));
    });
    std::sort(distances.begin(), distances.end());
    const auto at = [&](double fraction) {
        return distances[static_cast<std::size_t>(std::lround(fraction * double(distances.size() - 1)))];
    };
    SpacingStatistics statistics;
    statistics.mean = std::accumulate(distances.begin(), distances.end(), 0.0) / double(distances.size());
    statistics.median = at(0.5);
    statistics.p95 = at(0.95);
    statistics.max = distances.back();
    return statistics;
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
        throw Error(
            Errc::InvalidOptions,
            "write_points: " + path + ": expected a name ending in .xyz, .csv or .ply, got '" + extension + "'");
    }
    detail::write_atomically(path, [&](const std::string& temporary) {
        std::ofstream file(temporary, std::ios::binary);
        file.write(text.data(), static_cast<std::streamsize>(text.size()));
        file.close();
        if (!file) throw Error(Errc::Io, "write_points: " + path + ": cannot write");
    });
}

}  // namespace covol
