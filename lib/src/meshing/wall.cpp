#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "base/vector.h"
#include "covol/mesh_cleanup.h"

namespace covol {
namespace {

using cloud::cross, cloud::dot, cloud::minus, cloud::plus, cloud::times;

constexpr double kMostTests = 2e8;  // of rays against triangles: seconds
constexpr double kLeastRays = 16, kMostRays = 512;
constexpr double kThinShare = 0.01;  // a sliver of a triangle or two says nothing of the wall

constexpr double kFar = std::numeric_limits<double>::infinity();

std::array<Vec3, 3> corners(const TriangleMesh& mesh, std::size_t t) {
    std::array<Vec3, 3> c{};
    for (int n = 0; n < 3; ++n)
        for (int a = 0; a < 3; ++a) c[n][a] = mesh.vertices[mesh.triangles[t][n]][a];
    return c;
}

/// Distance along the ray, infinite where it misses. T. Möller, B. Trumbore, "Fast, minimum storage ray-triangle
/// intersection", Journal of Graphics Tools 2(1), 1997.
double hit(const Vec3& from, const Vec3& direction, const std::array<Vec3, 3>& triangle) {
    const Vec3 e1 = minus(triangle[1], triangle[0]), e2 = minus(triangle[2], triangle[0]);
    const Vec3 p = cross(direction, e2);
    const double det = dot(e1, p);
    if (det == 0) return kFar;
    const Vec3 s = minus(from, triangle[0]);
    const double u = dot(s, p) / det;
    if (u < 0 || u > 1) return kFar;
    const Vec3 q = cross(s, e1);
    const double v = dot(direction, q) / det;
    if (v < 0 || u + v > 1) return kFar;
    const double along = dot(e2, q) / det;
    return along > 0 ? along : kFar;
}

}  // namespace

double measure_wall(const TriangleMesh& mesh, const RunContext& run) {
    const std::size_t count = mesh.triangles.size();
    if (count == 0) return -1;
    const auto rays = std::min(count, std::size_t(std::clamp(kMostTests / double(count), kLeastRays, kMostRays)));
    std::vector<double> walls(rays, kFar);
    with_threads(run, [&] {
        tbb::parallel_for(std::size_t(0), rays, [&](std::size_t ray) {
            const std::size_t own = ray * count / rays;
            const std::array<Vec3, 3> c = corners(mesh, own);
            const Vec3 normal = cross(minus(c[1], c[0]), minus(c[2], c[0]));
            const double size = std::sqrt(dot(normal, normal));
            if (size == 0) return;
            const Vec3 inward = times(-1 / size, normal);
            const Vec3 middle = times(1.0 / 3, plus(plus(c[0], c[1]), c[2]));
            for (std::size_t t = 0; t < count; ++t)
                if (t != own) walls[ray] = std::min(walls[ray], hit(middle, inward, corners(mesh, t)));
        });
    });
    std::erase(walls, kFar);
    if (walls.empty()) return -1;
    const auto thin = walls.begin() + std::ptrdiff_t(kThinShare * double(walls.size()));
    std::nth_element(walls.begin(), thin, walls.end());
    return *thin;
}

}  // namespace covol
