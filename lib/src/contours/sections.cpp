#include "contours/sections.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "contours/contour_curve.h"
#include "contours/heuristics.h"

namespace covol::detail {
namespace {

constexpr std::size_t kMaxSectionNodes = 1u << 20;  // of a plane's grid

/// Selects discs greedily: the largest first, and none whose centre is within a selected disc.
std::vector<Vec2> centres_of_discs(const std::vector<float>& level, const SliceGrid& grid, bool inside,
                                   double minimum) {
    std::vector<std::size_t> order;
    const auto radius = [&](std::size_t n) { return inside ? -double(level[n]) : double(level[n]); };
    for (std::size_t n = 0; n < level.size(); ++n)
        if (radius(n) >= minimum) order.push_back(n);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return radius(a) > radius(b); });
    std::vector<Vec2> centres;
    std::vector<double> radii;
    for (const std::size_t n : order) {
        const Vec2 at{grid.origin[0] + grid.cell * double(n % std::size_t(grid.nx)),
                      grid.origin[1] + grid.cell * double(n / std::size_t(grid.nx))};
        bool covered = false;
        for (std::size_t m = 0; m < centres.size() && !covered; ++m)
            covered = std::hypot(at[0] - centres[m][0], at[1] - centres[m][1]) < radii[m];
        if (covered) continue;
        centres.push_back(at);
        radii.push_back(radius(n));
        if (double(centres.size()) >= kContours.network_discs) break;
    }
    return centres;
}

/// Whether the position is inside the polygons, by the even-odd rule.
bool is_inside(const std::vector<Polygon>& polygons, const Vec2& at) {
    bool inside = false;
    for (const Polygon& polygon : polygons)
        for (std::size_t n = 0, last = polygon.size() - 1; n < polygon.size(); last = n++) {
            const Vec2 &a = polygon[n], &b = polygon[last];
            if ((a[1] > at[1]) != (b[1] > at[1]) && at[0] < a[0] + (b[0] - a[0]) * (at[1] - a[1]) / (b[1] - a[1]))
                inside = !inside;
        }
    return inside;
}

SliceGrid grid_around(const std::vector<Polygon>& polygons, double cell) {
    Vec2 low = polygons.front().front(), high = low;
    for (const Polygon& polygon : polygons)
        for (const Vec2& p : polygon)
            for (int a = 0; a < 2; ++a) {
                low[a] = std::min(low[a], p[a]);
                high[a] = std::max(high[a], p[a]);
            }
    const double margin = kCommon.margin * std::max(high[0] - low[0], high[1] - low[1]) + 2 * cell;
    const double width = high[0] - low[0] + 2 * margin, height = high[1] - low[1] + 2 * margin;
    SliceGrid grid;
    grid.cell = std::max(cell, std::sqrt(width * height / double(kMaxSectionNodes)));
    grid.origin = {low[0] - margin, low[1] - margin};
    grid.nx = int(width / grid.cell) + 2;
    grid.ny = int(height / grid.cell) + 2;
    return grid;
}

}  // namespace

double SectionPlane::height(const Vec3& p) const { return dot(minus(p, origin), normal); }
Vec2 SectionPlane::flat(const Vec3& p) const { return {dot(minus(p, origin), u), dot(minus(p, origin), v)}; }
Vec3 SectionPlane::world(const Vec2& p) const {
    Vec3 at;
    for (int a = 0; a < 3; ++a) at[a] = origin[a] + p[0] * u[a] + p[1] * v[a];
    return at;
}

SectionPlane plane_through(const std::vector<Vec3>& points) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const Vec3& p : points) middle += Eigen::Vector3d(p[0], p[1], p[2]);
    middle /= double(points.size());
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Vec3& p : points) {
        const Eigen::Vector3d d = Eigen::Vector3d(p[0], p[1], p[2]) - middle;
        spread += d * d.transpose();
    }
    const Eigen::Matrix3d axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
    const Eigen::Vector3d u = axes.col(2), v = axes.col(1), normal = u.cross(v);
    return {
        {middle[0], middle[1], middle[2]}, {u[0], u[1], u[2]}, {v[0], v[1], v[2]}, {normal[0], normal[1], normal[2]}};
}

double thickness_along(const std::vector<Vec3>& points, const Vec3& direction) {
    double low = dot(points.front(), direction), high = low;
    for (const Vec3& p : points) {
        low = std::min(low, dot(p, direction));
        high = std::max(high, dot(p, direction));
    }
    return high - low;
}

double extent_of(const std::vector<Vec3>& points) {
    double extent = 0;
    for (const Vec3& axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}})
        extent = std::max(extent, thickness_along(points, axis));
    return extent;
}

std::vector<Section> sections_of(const std::vector<std::vector<Vec3>>& contours, double tolerance) {
    // Contours with many points come first, because they determine their common plane best.
    std::vector<std::size_t> order(contours.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return contours[a].size() > contours[b].size(); });
    std::vector<Section> sections;
    for (const std::size_t n : order) {
        const std::vector<Vec3>& contour = contours[n];
        auto own = std::find_if(sections.begin(), sections.end(), [&](const Section& section) {
            return std::all_of(contour.begin(), contour.end(),
                               [&](const Vec3& p) { return std::abs(section.plane.height(p)) <= tolerance; });
        });
        if (own == sections.end()) own = sections.insert(sections.end(), Section{plane_through(contour), {}});
        Polygon& polygon = own->polygons.emplace_back();
        for (const Vec3& p : contour) polygon.push_back(own->plane.flat(p));
    }
    return sections;
}

SectionMarks marks_along(const std::vector<Section>& sections, double step) {
    SectionMarks marks;
    for (const Section& section : sections)
        for (const Polygon& polygon : section.polygons) {
            std::vector<Vec3> curve;
            for (const Vec2& p : polygon) curve.push_back(section.plane.world(p));
            const std::vector<Vec3> places = evenly_along(curve, true, step);
            for (std::size_t n = 0; n < places.size(); ++n) {
                const Vec2 at = section.plane.flat(places[n]),
                           before = section.plane.flat(places[n == 0 ? places.size() - 1 : n - 1]),
                           after = section.plane.flat(places[(n + 1) % places.size()]);
                Vec2 out{after[1] - before[1], before[0] - after[0]};
                const double length = std::hypot(out[0], out[1]);
                if (!(length > 0)) continue;  // a contour of one or two positions
                out = {out[0] / length, out[1] / length};
                const double off = kCommon.same_place * step;  // distance at which the side is tested
                const Vec2 beside{at[0] + off * out[0], at[1] + off * out[1]};
                if (is_inside(section.polygons, beside)) out = {-out[0], -out[1]};
                const Vec3 tip = section.plane.world(out), zero = section.plane.origin;
                marks.places.push_back(places[n]);
                marks.outward.push_back(minus(tip, zero));
            }
        }
    return marks;
}

SectionLevels levels_of(const Section& section, double cell) {
    SectionLevels levels{section.plane, grid_around(section.polygons, cell), {}};
    levels.level = signed_distance_of_polygons(section.polygons, levels.grid);
    return levels;
}

Sides sides_of(const std::vector<Section>& sections, double cell) {
    Sides sides;
    for (const Section& section : sections) {
        const SectionLevels levels = levels_of(section, cell);
        for (const bool inside : {true, false})
            for (const Vec2& centre : centres_of_discs(levels.level, levels.grid, inside, levels.grid.cell))
                (inside ? sides.inside : sides.outside).push_back(section.plane.world(centre));
    }
    return sides;
}

}  // namespace covol::detail
