#include "points/convex_hull.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

#include <array>
#include <cmath>

namespace covol::detail {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Hull = CGAL::Surface_mesh<Kernel::Point_3>;

}  // namespace

std::vector<HalfSpace> convex_hull(const std::vector<Vec3>& points) {
    std::vector<Kernel::Point_3> all;
    all.reserve(points.size());
    for (const Vec3& p : points) all.emplace_back(p[0], p[1], p[2]);
    constexpr std::size_t kFewest = 4;  // minimum number of points, and of facets of a hull with volume
    if (all.size() < kFewest) return {};
    Hull hull;
    CGAL::convex_hull_3(all.begin(), all.end(), hull);
    if (hull.number_of_faces() < kFewest) return {};
    std::vector<HalfSpace> facets;
    for (const Hull::Face_index face : hull.faces()) {
        std::array<Kernel::Point_3, 3> corner;
        std::size_t n = 0;
        for (const Hull::Vertex_index v : hull.vertices_around_face(hull.halfedge(face)))
            if (n < corner.size()) corner[n++] = hull.point(v);
        const Kernel::Vector_3 normal = CGAL::cross_product(corner[1] - corner[0], corner[2] - corner[0]);
        const double length = std::sqrt(normal.squared_length());
        if (!(length > 0)) continue;  // zero area; the other facets alone bound the hull
        const Vec3 unit{normal.x() / length, normal.y() / length, normal.z() / length};
        facets.push_back({unit, unit[0] * corner[0].x() + unit[1] * corner[0].y() + unit[2] * corner[0].z()});
    }
    return facets;
}

}  // namespace covol::detail
