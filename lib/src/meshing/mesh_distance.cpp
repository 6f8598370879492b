#include "meshing/mesh_distance.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numeric>

#include "covol/error.h"
#include "covol/mesh_cleanup.h"
#include "covol/points.h"
#include "covol/surface.h"

namespace covol {
namespace detail {
namespace {

using Cartesian = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Cartesian::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Cartesian, Triangles::const_iterator>;

Cartesian::Point_3 to_cgal(const Vec3& p) { return {p[0], p[1], p[2]}; }

/// A search tree of a part of a mesh's triangles.
class TriangleTree {
public:
    TriangleTree(const TriangleMesh& mesh, std::size_t begin, std::size_t end) : begin_(begin) {
        triangles_.reserve(end - begin);
        for (std::size_t n = begin; n < end; ++n) {
            const auto& t = mesh.triangles[n];
            triangles_.emplace_back(to_cgal(mesh.place(t[0])), to_cgal(mesh.place(t[1])), to_cgal(mesh.place(t[2])));
        }
        tree_.insert(triangles_.begin(), triangles_.end());
        // By default, CGAL would build a tree of vertices for initial bounds, which takes as much time as all queries;
        // the result for the previous point is a better bound.
        tree_.do_not_accelerate_distance_queries();
        tree_.build();  // now, because it must be complete before parallel queries
    }
    /// The point closest to the query among `guess` and all points of the triangles.
    [[nodiscard]] Cartesian::Point_3 closest_point(const Cartesian::Point_3& query,
                                                   const Cartesian::Point_3& guess) const {
        return tree_.closest_point(query, guess);
    }
    /// Distance along a ray to the first triangle; infinite if it hits none.
    /// @param own  a triangle of the mesh to be ignored
    [[nodiscard]] double first_hit(const Cartesian::Ray_3& ray, std::size_t own) const {
        const auto is_own = [&](Triangles::const_iterator t) {
            return begin_ + std::size_t(t - triangles_.begin()) == own;
        };
        // Treated here, because CGAL does not apply the filter `is_own` in a tree of a single triangle.
        if (triangles_.size() == 1 && is_own(triangles_.begin())) return std::numeric_limits<double>::infinity();
        const auto hit = tree_.first_intersection(ray, is_own);
        if (!hit) return std::numeric_limits<double>::infinity();
        if (const auto* point = boost::get<Cartesian::Point_3>(&hit->first))
            return std::sqrt(CGAL::squared_distance(ray.source(), *point));
        return std::sqrt(CGAL::squared_distance(ray.source(), boost::get<Cartesian::Segment_3>(hit->first)));
    }

private:
    std::size_t begin_;
    Triangles triangles_;
    CGAL::AABB_tree<CGAL::AABB_traits<Cartesian, Primitive>> tree_;
};

/// Several trees, each of consecutive triangles, most of which are close together. CGAL builds a tree on one thread,
/// and smaller trees faster, so several trees are built in parallel. Each additional tree costs a query one test of its
/// root.
std::vector<std::unique_ptr<TriangleTree>> trees_of(const TriangleMesh& mesh) {
    constexpr std::size_t kTriangles = 1 << 17;
    const std::size_t count = mesh.triangles.size();
    std::vector<std::unique_ptr<TriangleTree>> trees((count + kTriangles - 1) / kTriangles);
    tbb::parallel_for(std::size_t(0), trees.size(), [&](std::size_t n) {
        trees[n] = std::make_unique<TriangleTree>(mesh, n * kTriangles, std::min(count, (n + 1) * kTriangles));
    });
    return trees;
}

}  // namespace

std::vector<double> distances_to(const TriangleMesh& mesh, const std::vector<Vec3>& points) {
    const std::vector<std::unique_ptr<TriangleTree>> trees = trees_of(mesh);
    if (points.empty()) return {};
    const std::vector<std::uint32_t> order = order_spatially(points, points.size());
    std::vector<double> distances(points.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, order.size(), 256), [&](const auto& range) {
        Cartesian::Point_3 closest = to_cgal(mesh.place(mesh.triangles.front()[0]));
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const Cartesian::Point_3 query = to_cgal(points[order[n]]);
            for (const auto& tree : trees) closest = tree->closest_point(query, closest);
            distances[order[n]] = std::sqrt(CGAL::squared_distance(query, closest));
        }
    });
    return distances;
}

FitStatistics statistics_of(std::vector<double> distances) {
    FitStatistics fit;
    fit.mean = std::accumulate(distances.begin(), distances.end(), 0.0) / double(distances.size());
    const auto rank = std::size_t(std::ceil(0.95 * double(distances.size()))) - 1;
    std::nth_element(distances.begin(), distances.begin() + std::ptrdiff_t(rank), distances.end());
    fit.p95 = distances[rank];
    fit.max = *std::max_element(distances.begin() + std::ptrdiff_t(rank), distances.end());
    return fit;
}

}  // namespace detail

FitStatistics measure_fit(const std::vector<Vec3>& points, const TriangleMesh& mesh, const RunContext& run) {
    if (points.empty()) throw Error(Errc::InvalidInput, "points: expected at least one, got none");
    if (mesh.empty()) throw Error(Errc::InvalidInput, "the surface has no triangle");
    std::vector<double> distances;
    with_threads(run, [&] { distances = detail::distances_to(mesh, points); });
    return detail::statistics_of(std::move(distances));
}

double measure_wall(const TriangleMesh& mesh, const RunContext& run) {
    constexpr std::size_t kMaxRays = 512;
    // The result is this quantile of the distances from triangles along inward rays to the opposite side of the wall,
    // not the minimum, because single slivers do not represent the wall.
    constexpr double kThinFraction = 0.01;
    const std::size_t count = mesh.triangles.size(), rays = std::min(count, kMaxRays);
    std::vector<double> walls(rays, std::numeric_limits<double>::infinity());
    with_threads(run, [&] {
        const std::vector<std::unique_ptr<detail::TriangleTree>> trees = detail::trees_of(mesh);
        tbb::parallel_for(std::size_t(0), rays, [&](std::size_t ray) {
            const std::size_t own = ray * count / rays;
            const auto& t = mesh.triangles[own];
            const detail::Cartesian::Triangle_3 triangle(detail::to_cgal(mesh.place(t[0])),
                                                         detail::to_cgal(mesh.place(t[1])),
                                                         detail::to_cgal(mesh.place(t[2])));
            if (triangle.is_degenerate()) return;
            const detail::Cartesian::Ray_3 inward(CGAL::centroid(triangle),
                                                  -triangle.supporting_plane().orthogonal_vector());
            for (const auto& tree : trees) walls[ray] = std::min(walls[ray], tree->first_hit(inward, own));
        });
    });
    std::erase(walls, std::numeric_limits<double>::infinity());
    if (walls.empty()) return -1;
    const auto thin = walls.begin() + std::ptrdiff_t(kThinFraction * double(walls.size()));
    std::nth_element(walls.begin(), thin, walls.end());
    return *thin;
}

}  // namespace covol
