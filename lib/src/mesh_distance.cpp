#include "detail/mesh_distance.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "covol/error.h"
#include "covol/surface.h"

namespace covol {
namespace detail {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;

}  // namespace

struct MeshDistance::Tree {
    Triangles triangles;
    CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>> tree;
};

MeshDistance::MeshDistance(const TriangleMesh& mesh) : tree_(std::make_unique<Tree>()) {
    const auto corner = [&](std::uint32_t v) {
        return Kernel::Point_3(mesh.vertices[v][0], mesh.vertices[v][1], mesh.vertices[v][2]);
    };
    tree_->triangles.reserve(mesh.triangles.size());
    for (const auto& t : mesh.triangles) tree_->triangles.emplace_back(corner(t[0]), corner(t[1]), corner(t[2]));
    tree_->tree.insert(tree_->triangles.begin(), tree_->triangles.end());
    // Now, for queries from many threads must find the tree finished.
    tree_->tree.build();
    tree_->tree.accelerate_distance_queries();
}

MeshDistance::~MeshDistance() = default;

double MeshDistance::operator()(const Vec3& point) const {
    return std::sqrt(tree_->tree.squared_distance(Kernel::Point_3(point[0], point[1], point[2])));
}

}  // namespace detail

FitStatistics points_to_surface(const std::vector<Vec3>& points, const TriangleMesh& mesh, const RunContext& run) {
    if (points.empty()) throw Error(Errc::InvalidInput, "points_to_surface: expected at least one point, got none");
    if (mesh.empty()) throw Error(Errc::InvalidInput, "points_to_surface: the surface has no triangle");
    std::vector<double> distances(points.size());
    with_threads(run, [&] {
        const detail::MeshDistance distance(mesh);
        tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t i) { distances[i] = distance(points[i]); });
    });
    FitStatistics fit;
    fit.mean = std::accumulate(distances.begin(), distances.end(), 0.0) / double(distances.size());
    const auto rank = std::size_t(std::ceil(0.95 * double(distances.size()))) - 1;
    std::nth_element(distances.begin(), distances.begin() + std::ptrdiff_t(rank), distances.end());
    fit.p95 = distances[rank];
    fit.max = *std::max_element(distances.begin() + std::ptrdiff_t(rank), distances.end());
    return fit;
}

}  // namespace covol
