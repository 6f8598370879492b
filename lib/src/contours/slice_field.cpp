#include "contours/slice_field.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace covol::detail {
namespace {

// [cells] Edges are processed in pieces of at most this length, because the box around a long oblique edge would
// contain many nodes that are far from the edge.
constexpr double kSeedPiece = 8;

struct Edge {
    float x, y, dx, dy, inverse;  // start and direction in cells; inverse of the squared length, or 0
};

float squared_distance(const Edge& e, float x, float y) {
    const float px = x - e.x, py = y - e.y;
    const float t = std::clamp((px * e.dx + py * e.dy) * e.inverse, 0.0F, 1.0F);
    const float qx = px - t * e.dx, qy = py - t * e.dy;
    return qx * qx + qy * qy;
}

std::vector<Edge> edges_of(const std::vector<Polygon>& polygons, const SliceGrid& grid) {
    std::vector<Edge> edges;
    for (const Polygon& polygon : polygons)
        for (std::size_t n = 0; n < polygon.size(); ++n) {
            const Vec2 &a = polygon[n], &b = polygon[(n + 1) % polygon.size()];
            const double dx = (b[0] - a[0]) / grid.cell, dy = (b[1] - a[1]) / grid.cell;
            const double length2 = dx * dx + dy * dy;
            edges.push_back({float((a[0] - grid.origin[0]) / grid.cell), float((a[1] - grid.origin[1]) / grid.cell),
                             float(dx), float(dy), length2 > 0 ? float(1 / length2) : 0.0F});
        }
    return edges;
}

/// Finds the nearest edge of each node by sweeps over the grid.
class Sweep {
public:
    Sweep(const std::vector<Edge>& edges, const SliceGrid& grid)
        : edges_(edges),
          grid_(grid),
          distance_(grid.size(), std::numeric_limits<float>::max()),
          edge_(grid.size(), -1) {}

    std::vector<float> run() {
        for (std::size_t n = 0; n < edges_.size(); ++n) seed(std::int32_t(n));
        for (int round = 0; round < 2; ++round) {
            for (int j = 0; j < grid_.ny; ++j) row(j, -1);
            for (int j = grid_.ny - 1; j >= 0; --j) row(j, +1);
        }
        return std::move(distance_);
    }

private:
    [[nodiscard]] std::size_t at(int i, int j) const { return std::size_t(j) * std::size_t(grid_.nx) + std::size_t(i); }

    void offer(int i, int j, std::int32_t edge) {
        const std::size_t n = at(i, j);
        if (edge < 0 || edge == edge_[n]) return;
        const float d = squared_distance(edges_[std::size_t(edge)], float(i), float(j));
        if (d >= distance_[n]) return;
        distance_[n] = d;
        edge_[n] = edge;
    }

    void seed(std::int32_t n) {
        const Edge& e = edges_[std::size_t(n)];
        const int pieces = 1 + int(std::hypot(e.dx, e.dy) / kSeedPiece);
        for (int piece = 0; piece < pieces; ++piece) {
            const float s = float(piece) / float(pieces), t = float(piece + 1) / float(pieces);
            const auto [x0, x1] = std::minmax({e.x + s * e.dx, e.x + t * e.dx});
            const auto [y0, y1] = std::minmax({e.y + s * e.dy, e.y + t * e.dy});
            const int i0 = std::max(int(std::floor(x0)) - 1, 0), i1 = std::min(int(std::ceil(x1)) + 1, grid_.nx - 1);
            const int j0 = std::max(int(std::floor(y0)) - 1, 0), j1 = std::min(int(std::ceil(y1)) + 1, grid_.ny - 1);
            for (int j = j0; j <= j1; ++j)
                for (int i = i0; i <= i1; ++i) offer(i, j, n);
        }
    }

    /// Improves the nearest edges of row j by those of row j + before (before: -1 or 1), then along row j in both
    /// directions.
    void row(int j, int before) {
        const int other = j + before;
        const bool has_other = other >= 0 && other < grid_.ny;
        for (int i = 0; i < grid_.nx; ++i) {
            if (has_other)
                for (int k = std::max(i - 1, 0); k <= std::min(i + 1, grid_.nx - 1); ++k)
                    offer(i, j, edge_[at(k, other)]);
            if (i > 0) offer(i, j, edge_[at(i - 1, j)]);
        }
        for (int i = grid_.nx - 2; i >= 0; --i) offer(i, j, edge_[at(i + 1, j)]);
    }

    const std::vector<Edge>& edges_;
    const SliceGrid& grid_;
    std::vector<float> distance_;  // squared, cells
    std::vector<std::int32_t> edge_;
};

/// The sorted crossings of each row of nodes with the edges.
std::vector<std::vector<double>> crossings_by_row(const std::vector<Polygon>& polygons, const SliceGrid& grid) {
    std::vector<std::vector<double>> rows(static_cast<std::size_t>(grid.ny));
    for (const Polygon& polygon : polygons)
        for (std::size_t n = 0; n < polygon.size(); ++n) {
            Vec2 a = polygon[n], b = polygon[(n + 1) % polygon.size()];
            if (a[1] > b[1]) std::swap(a, b);
            const auto row_of = [&](double y) { return (y - grid.origin[1]) / grid.cell; };
            // If a row of nodes passes through a vertex, it crosses only those edges of which this is the lower end, so
            // that the parity of the crossings is correct.
            const int first = std::max(int(std::ceil(row_of(a[1]))), 0);
            for (int j = first; j < grid.ny && j < row_of(b[1]); ++j) {
                const double t = (j - row_of(a[1])) / (row_of(b[1]) - row_of(a[1]));
                rows[std::size_t(j)].push_back((a[0] + t * (b[0] - a[0]) - grid.origin[0]) / grid.cell);
            }
        }
    for (auto& row : rows) std::sort(row.begin(), row.end());
    return rows;
}

}  // namespace

std::vector<float> signed_distance_of_polygons(const std::vector<Polygon>& polygons, const SliceGrid& grid) {
    const std::vector<Edge> edges = edges_of(polygons, grid);
    std::vector<float> values = Sweep(edges, grid).run();
    const auto rows = crossings_by_row(polygons, grid);
    const auto cell = float(grid.cell);
    for (int j = 0; j < grid.ny; ++j) {
        float* row = values.data() + std::size_t(j) * std::size_t(grid.nx);
        const std::vector<double>& crossings = rows[std::size_t(j)];
        std::size_t passed = 0;
        for (int i = 0; i < grid.nx; ++i) {
            while (passed < crossings.size() && crossings[passed] < i) ++passed;
            row[i] = std::sqrt(row[i]) * (passed % 2 == 1 ? -cell : cell);
        }
    }
    return values;
}

SlicePlace place_in(const SliceGrid& grid, double x, double y) {
    const double u = (x - grid.origin[0]) / grid.cell, v = (y - grid.origin[1]) / grid.cell;
    const double cu = std::clamp(u, 0.0, double(grid.nx - 1)), cv = std::clamp(v, 0.0, double(grid.ny - 1));
    const int i = std::min(int(cu), grid.nx - 2), j = std::min(int(cv), grid.ny - 2);
    const bool is_within = u == cu && v == cv;
    return {std::size_t(j) * std::size_t(grid.nx) + std::size_t(i), cu - i, cv - j,
            is_within ? 0 : grid.cell * std::hypot(u - cu, v - cv)};
}

PolygonMoments moments(const Polygon& polygon) {
    PolygonMoments m;
    Vec2 mean{0, 0};
    double twice = 0;
    // Coordinates are relative to the first vertex, because the formula loses precision far from the origin.
    for (std::size_t n = 0; n < polygon.size(); ++n) {
        const Vec2 &o = polygon[0], &p = polygon[n], &q = polygon[(n + 1) % polygon.size()];
        const double ax = p[0] - o[0], ay = p[1] - o[1], bx = q[0] - o[0], by = q[1] - o[1];
        const double cross = ax * by - bx * ay;
        twice += cross;
        m.centroid[0] += cross * (ax + bx) / 3;
        m.centroid[1] += cross * (ay + by) / 3;
        mean[0] += ax / double(polygon.size());
        mean[1] += ay / double(polygon.size());
    }
    m.area = std::abs(twice) / 2;
    for (int a = 0; a < 2; ++a) m.centroid[a] = polygon[0][a] + (twice != 0 ? m.centroid[a] / twice : mean[a]);
    return m;
}

}  // namespace covol::detail
