#include "cloud/orientation/propagation.h"

#include <tbb/parallel_sort.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <utility>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "cloud/orientation/heuristics.h"
#include "points/heuristics.h"
#include "points/neighbours.h"

namespace covol::cloud {
namespace {

/// Disjoint sets of points, with the sign of each point relative to that of its set.
class SignedSets {
public:
    explicit SignedSets(std::size_t count) : parent_(count), is_opposite_(count, 0) {
        std::iota(parent_.begin(), parent_.end(), 0U);
    }
    /// The set of a point and whether its sign is opposite to that of the set.
    [[nodiscard]] std::pair<std::uint32_t, bool> find(std::uint32_t n) {
        std::uint32_t root = n;
        bool opposite = false;
        for (; parent_[root] != root; root = parent_[root]) opposite ^= is_opposite_[root] != 0;
        bool left = opposite;
        while (parent_[n] != root && n != root) {  // path compression
            const bool own = is_opposite_[n] != 0;
            const std::uint32_t next = parent_[n];
            parent_[n] = root;
            is_opposite_[n] = left;
            left ^= own;
            n = next;
        }
        return {root, opposite};
    }
    /// Merges the sets of points n and m, if they differ, such that the points have opposite or equal signs.
    void unite(std::uint32_t n, std::uint32_t m, bool opposite) {
        const auto [a, a_opposite] = find(n);
        const auto [b, b_opposite] = find(m);
        if (a == b) return;
        parent_[a] = b;
        is_opposite_[a] = opposite ^ a_opposite ^ b_opposite;
    }

private:
    std::vector<std::uint32_t> parent_;
    std::vector<char> is_opposite_;
};

struct Edge {
    float cost;
    std::uint32_t a, b;
    friend bool operator<(const Edge& x, const Edge& y) {
        return std::tie(x.cost, x.a, x.b) < std::tie(y.cost, y.a, y.b);
    }
};

std::vector<Edge> edges_of(const std::vector<Vec3>& points, const std::vector<Vec3>& normals, double spacing) {
    const PointCells cells(points, kNear.first_radius * spacing);
    std::vector<Edge> edges(points.size() * kCommon.ring);
    for_nearest(cells, spacing, kCommon.ring, [&](std::uint32_t point, const std::vector<Neighbour>& near) {
        std::size_t at = point * kCommon.ring;
        for (const Neighbour& neighbour : near) {
            const std::uint32_t other = cells.order()[neighbour.at];
            const Vec3 way = unit(minus(points[other], points[point]));
            const double out = std::max(std::abs(dot(way, normals[point])), std::abs(dot(way, normals[other])));
            const double turn = 1 - std::abs(dot(normals[point], normals[other]));
            edges[at++] = {float(std::max(turn, out * out)), point, other};
        }
    });
    std::erase_if(edges, [](const Edge& edge) { return edge.a == edge.b; });
    tbb::parallel_sort(edges.begin(), edges.end());
    return edges;
}

}  // namespace

std::vector<Vec3> plane_normals(const std::vector<Vec3>& points, const CloudScale& scale) {
    const double radius = kCommon.errors * scale.noise / scale.spacing;  // in spacings
    const auto count = std::size_t(std::clamp(M_PI * radius * radius, double(kCommon.quadric), kPropagation.maximum));
    const PointCells cells(points, kNear.first_radius * scale.spacing);
    std::vector<Vec3> normals(points.size());
    for_nearest(cells, scale.spacing, count, [&](std::uint32_t point, const std::vector<Neighbour>& near) {
        const auto [sum, squares] = moments_of(cells, points[point], near);
        const double all = double(near.size()) + 1;
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares / all - sum * sum.transpose() / (all * all));
        const Eigen::Vector3d thin = axes.eigenvectors().col(0);
        normals[point] = {thin[0], thin[1], thin[2]};
    });
    return normals;
}

std::vector<Vec3> propagated_normals(const std::vector<Vec3>& points, CloudScale scale, double spacing,
                                     const std::vector<Vec3>& towards) {
    scale.spacing = spacing;
    std::vector<Vec3> normals = plane_normals(points, scale);
    SignedSets sets(points.size());
    for (const Edge& edge : edges_of(points, normals, spacing))
        sets.unite(edge.a, edge.b, dot(normals[edge.a], normals[edge.b]) < 0);
    std::vector<std::pair<std::uint32_t, bool>> of(points.size());
    std::vector<Vec3> middle(points.size(), Vec3{0, 0, 0});
    std::vector<double> count(points.size(), 0), outward(points.size(), 0);
    for (std::uint32_t n = 0; n < points.size(); ++n) {
        of[n] = sets.find(n);
        if (of[n].second) normals[n] = times(-1, normals[n]);
        middle[of[n].first] = plus(middle[of[n].first], points[n]);
        ++count[of[n].first];
    }
    for (std::size_t n = 0; n < points.size(); ++n) {
        const std::size_t set = of[n].first;
        const Vec3 out = towards.empty() ? minus(points[n], times(1 / count[set], middle[set])) : towards[n];
        outward[set] += dot(out, normals[n]);
    }
    for (std::size_t n = 0; n < points.size(); ++n)
        if (outward[of[n].first] < 0) normals[n] = times(-1, normals[n]);
    return normals;
}

}  // namespace covol::cloud
