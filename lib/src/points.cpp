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
#include <functional>
#include <limits>
#include <numeric>
#include <sstream>

#include "covol/error.h"
#include "detail/file.h"
#include "detail/kd_tree.h"
#include "detail/point_files.h"

namespace covol {
namespace {

using detail::squared_distance;

// ---------------------------------------------------------------------------------------------- check_inside

Vec3 reversed(const Vec3& p) { return {p[2], p[1], p[0]}; }

std::size_t count_outside(const std::vector<Vec3>& points, const ImageGeometry& geometry,
                          const std::function<Vec3(const Vec3&)>& change) {
    constexpr double kTolerance = 1e-3;  // voxels
    std::size_t outside = 0;
    for (const Vec3& point : points) {
        const Vec3 index = geometry.world_to_index(change(point));
        bool inside = true;
        for (int a = 0; a < 3; ++a)
            inside = inside && index[a] >= -0.5 - kTolerance && index[a] <= geometry.size[a] - 0.5 + kTolerance;
        outside += inside ? 0 : 1;
    }
    return outside;
}

std::string box_text(const WorldBox& box) {
    std::ostringstream s;
    s << "(" << box.min[0] << ", " << box.min[1] << ", " << box.min[2] << ") to (" << box.max[0] << ", " << box.max[1]
      << ", " << box.max[2] << ")";
    return s.str();
}

struct Remedy {
    std::string advice;
    std::function<Vec3(const Vec3&)> change;  ///< the world position with that advice taken
};

std::vector<Remedy> remedies(const ImageGeometry& g, PointSpace space) {
    std::vector<Remedy> list;
    if (space == PointSpace::Index) {
        list.push_back({"--points-order zyx would bring them inside",
                        [&g](const Vec3& p) { return g.index_to_world(reversed(g.world_to_index(p))); }});
        list.push_back(
            {"--points-space world would bring them inside", [&g](const Vec3& p) { return g.world_to_index(p); }});
        list.push_back({"--points-space world --points-order zyx would bring them inside",
                        [&g](const Vec3& p) { return reversed(g.world_to_index(p)); }});
    } else {
        list.push_back({"--points-order zyx would bring them inside", reversed});
        list.push_back(
            {"--points-space index would bring them inside", [&g](const Vec3& p) { return g.index_to_world(p); }});
        list.push_back({"--points-space index --points-order zyx would bring them inside",
                        [&g](const Vec3& p) { return g.index_to_world(reversed(p)); }});
        list.push_back({"they fit with x and y negated: they are in RAS, the image is in LPS", [](const Vec3& p) {
                            return Vec3{-p[0], -p[1], p[2]};
                        }});
        for (const double factor : {1e3, 1e-3})
            list.push_back({std::string("they fit when multiplied by ") + (factor > 1 ? "1000" : "0.001") +
                                ": their unit is another than the image's",
                            [factor](const Vec3& p) {
                                return Vec3{factor * p[0], factor * p[1], factor * p[2]};
                            }});
    }
    return list;
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
    detail::PointTable table = detail::read_point_table(path);
    if (table.points.empty())
        throw Error(Errc::InvalidInput, "read_points: " + path + ": expected at least one point, got none");
    PointCloud cloud;
    cloud.source = path;
    cloud.space = options.space != PointSpace::Unstated ? options.space
                  : table.space != PointSpace::Unstated ? table.space
                                                        : PointSpace::World;
    const PointOrder order = options.order != PointOrder::Unstated ? options.order : table.order;
    cloud.points = std::move(table.points);
    if (order == PointOrder::ZYX)
        for (Vec3& p : cloud.points) std::swap(p[0], p[2]);
    cloud.rule = table.rule + ", as " + (order == PointOrder::ZYX ? "z, y, x" : "x, y, z") + " in " +
                 (cloud.space == PointSpace::Index ? "voxels" : "world units");
    return cloud;
}

std::vector<Vec3> to_world(const PointCloud& cloud, const ImageGeometry* geometry) {
    if (cloud.space != PointSpace::Index) return cloud.points;
    if (geometry == nullptr)
        throw Error(Errc::InvalidInput, "to_world: " + cloud.source +
                                            ": the points are in voxels of an image, and there is no image; give one, "
                                            "or --points-space world");
    std::vector<Vec3> world;
    world.reserve(cloud.points.size());
    for (const Vec3& p : cloud.points) world.push_back(geometry->index_to_world(p));
    return world;
}

void check_inside(const std::vector<Vec3>& world_points, const ImageGeometry& geometry, const std::string& source,
                  PointSpace space) {
    const std::size_t outside = count_outside(world_points, geometry, [](const Vec3& p) { return p; });
    if (outside == 0) return;
    std::string message = "check_inside: " + source + ": " + std::to_string(outside) + " of " +
                          std::to_string(world_points.size()) + " points lie outside the image: points from " +
                          box_text(bounding_box(world_points)) + ", image from " + box_text(geometry.world_box());
    for (const Remedy& remedy : remedies(geometry, space))
        if (count_outside(world_points, geometry, remedy.change) == 0)
            throw Error(Errc::InvalidInput, message + "; " + remedy.advice);
    if (!geometry.spacing_known) message += "; the image states no spacing, --spacing sx,sy,sz gives it";
    throw Error(Errc::InvalidInput, message);
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
