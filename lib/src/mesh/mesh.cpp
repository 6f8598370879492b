#include "covol/mesh.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

#include "base/disjoint_sets.h"
#include "covol/domain.h"
#include "mesh/corner_table.h"
#include "mesh/vertex_normals.h"

namespace covol {
namespace {

using detail::DisjointSets;

Vec3 point(const TriangleMesh& mesh, std::uint32_t v) { return meshing::to_vec3(mesh.vertices[v]); }

bool is_degenerate(const std::array<std::uint32_t, 3>& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

/// The side of triangle t from corner k to corner k+1 has the number 3 t + k. Sides are grouped by the lower one of
/// their two vertex numbers; `high` is the other one.
struct Side {
    std::uint32_t high;
    std::uint32_t number;
    friend bool operator<(const Side& a, const Side& b) {
        return a.high != b.high ? a.high < b.high : a.number < b.number;
    }
};
std::uint32_t corner_vertex(const TriangleMesh& mesh, std::uint32_t corner) {
    return mesh.triangles[corner / 3][corner % 3];
}
std::uint32_t next_corner(std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }

/// Calls visit(first, last) for each edge, with the range of the triangles' sides that lie on it; degenerate triangles
/// are skipped.
template <typename Visit>
void for_each_edge(const TriangleMesh& mesh, const Visit& visit) {
    const std::uint32_t corners = meshing::corner_count(mesh.triangles.size());
    const auto low = [&](std::uint32_t c) {
        return std::min(corner_vertex(mesh, c), corner_vertex(mesh, next_corner(c)));
    };
    std::vector<std::uint32_t> first(mesh.vertices.size() + 1, 0);
    for (std::uint32_t c = 0; c < corners; ++c)
        if (!is_degenerate(mesh.triangles[c / 3])) ++first[low(c) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<Side> sides(first.back());
    std::vector<std::uint32_t> fill(first.begin(), first.end() - 1);
    for (std::uint32_t c = 0; c < corners; ++c)
        if (!is_degenerate(mesh.triangles[c / 3]))
            sides[fill[low(c)]++] = {std::max(corner_vertex(mesh, c), corner_vertex(mesh, next_corner(c))), c};
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        Side* side = sides.data() + first[v];
        Side* const end = sides.data() + first[v + 1];
        std::sort(side, end);
        while (side != end) {
            Side* last = side + 1;
            while (last != end && last->high == side->high) ++last;
            visit(side, last);
            side = last;
        }
    }
}

double six_volumes(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t, const Vec3& origin) {
    return meshing::six_volumes({point(mesh, t[0]), point(mesh, t[1]), point(mesh, t[2])}, origin);
}

}  // namespace

MeshMeasures measure(const TriangleMesh& mesh) {
    MeshMeasures m;
    if (mesh.empty()) return m;
    const Vec3 origin = point(mesh, mesh.triangles.front()[0]);
    bool degenerate = false;
    std::vector<bool> used(mesh.vertices.size(), false);
    for (const auto& t : mesh.triangles) {
        m.volume += six_volumes(mesh, t, origin) / 6;
        m.area +=
            length(cross(minus(point(mesh, t[1]), point(mesh, t[0])), minus(point(mesh, t[2]), point(mesh, t[0])))) / 2;
        degenerate = degenerate || is_degenerate(t);
        for (const std::uint32_t v : t) used[v] = true;
    }

    m.closed = m.manifold = !degenerate;
    DisjointSets components(mesh.triangles.size());
    DisjointSets umbrellas(meshing::corner_count(mesh.triangles.size()));  // sets of corners around the same vertex
    std::int64_t edges = 0;
    for_each_edge(mesh, [&](const Side* first, const Side* last) {
        ++edges;
        const auto count = last - first;
        if (count > 2) m.manifold = false;
        const std::uint32_t c = first->number;
        if (count != 2 || corner_vertex(mesh, c) == corner_vertex(mesh, first[1].number)) m.closed = false;
        for (const Side* other = first + 1; other != last; ++other) {
            const std::uint32_t o = other->number;
            components.unite(c / 3, o / 3);
            const bool opposite = corner_vertex(mesh, c) != corner_vertex(mesh, o);
            umbrellas.unite(c, opposite ? next_corner(o) : o);
            umbrellas.unite(next_corner(c), opposite ? o : next_corner(o));
        }
    });
    std::int64_t umbrella_count = 0;
    for (std::uint32_t c = 0; c < 3 * mesh.triangles.size(); ++c) umbrella_count += umbrellas.root(c) == c;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) m.components += components.root(t) == t;
    if (umbrella_count != std::count(used.begin(), used.end(), true)) m.manifold = false;
    const std::int64_t euler = umbrella_count - edges + std::int64_t(mesh.triangles.size());
    m.genus = m.closed ? int(m.components - euler / 2) : -1;
    return m;
}

double smallest_angle(const TriangleMesh& mesh) {
    if (mesh.empty()) return 0;
    std::vector<float> worst(mesh.triangles.size());
    std::transform(mesh.triangles.begin(), mesh.triangles.end(), worst.begin(), [&](const auto& t) {
        return float(meshing::worst_cosine(point(mesh, t[0]), point(mesh, t[1]), point(mesh, t[2])));
    });
    const auto rank = std::ptrdiff_t(worst.size() / 100);
    std::nth_element(worst.begin(), worst.begin() + rank, worst.end(), std::greater<>());
    return std::acos(std::clamp(double(worst[std::size_t(rank)]), -1.0, 1.0)) * 180 / std::numbers::pi;
}

std::array<Vec3, 3> meshing::corner_normals(const std::array<Vec3, 3>& corners) {
    std::array<Vec3, 3> normals{};
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 a = minus(corners[(k + 1) % 3], corners[k]);
        const Vec3 b = minus(corners[(k + 2) % 3], corners[k]);
        const Vec3 normal = cross(a, b);
        const double size = length(normal);
        if (!(size > 0)) continue;
        const double angle = std::atan2(size, dot(a, b));
        for (std::size_t c = 0; c < 3; ++c) normals[k][c] = angle / size * normal[c];
    }
    return normals;
}

void meshing::add_normals(const std::array<Vec3, 3>& normals, const std::array<Vec3*, 3>& sums) {
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < 3; ++c) (*sums[k])[c] += normals[k][c];
}

std::array<float, 3> meshing::unit_normal(const Vec3& sum) {
    const double size = length(sum);
    // A vertex of degenerate triangles only has no normal, but most file formats require a unit vector.
    return size > 0 ? std::array{float(sum[0] / size), float(sum[1] / size), float(sum[2] / size)}
                    : std::array{0.0F, 0.0F, 1.0F};
}

std::vector<std::array<float, 3>> meshing::vertex_normals(const std::vector<std::array<float, 3>>& vertices,
                                                          const std::vector<Triangle>& triangles) {
    // The angles, which take most of the time, are computed in parallel; the sums are always computed in the order of
    // the triangles, so that they do not depend on the number of threads.
    constexpr std::size_t kAtOnce = 1 << 15;
    std::vector<Vec3> sums(vertices.size(), Vec3{0, 0, 0});
    std::vector<std::array<Vec3, 3>> parts(std::min(kAtOnce, triangles.size()));
    for (std::size_t begin = 0; begin < triangles.size(); begin += kAtOnce) {
        const std::size_t end = std::min(begin + kAtOnce, triangles.size());
        tbb::parallel_for(begin, end, [&](std::size_t n) {
            const Triangle& t = triangles[n];
            parts[n - begin] =
                corner_normals({to_vec3(vertices[t[0]]), to_vec3(vertices[t[1]]), to_vec3(vertices[t[2]])});
        });
        for (std::size_t n = begin; n < end; ++n) {
            const Triangle& t = triangles[n];
            add_normals(parts[n - begin], {&sums[t[0]], &sums[t[1]], &sums[t[2]]});
        }
    }
    std::vector<std::array<float, 3>> normals(sums.size());
    std::transform(sums.begin(), sums.end(), normals.begin(), unit_normal);
    return normals;
}

std::vector<std::array<float, 3>> compute_vertex_normals(const TriangleMesh& mesh) {
    return meshing::vertex_normals(mesh.vertices, mesh.triangles);
}

Vec3 choose_mesh_origin(const WorldBox& box, double finest) {
    constexpr double kFar = 1 << 17;
    double farthest = 0;
    for (int a = 0; a < 3; ++a) farthest = std::max({farthest, std::abs(box.min[a]), std::abs(box.max[a])});
    if (!(finest > 0) || !(farthest > kFar * finest)) return {0, 0, 0};
    const double round = std::pow(10.0, std::ceil(std::log10(std::max(longest_side(box), finest))));
    Vec3 origin;
    for (int a = 0; a < 3; ++a) origin[a] = round * std::round((box.min[a] + box.max[a]) / 2 / round);
    return origin;
}

void move_mesh_origin(TriangleMesh& mesh, const Vec3& origin) {
    if (origin == mesh.origin) return;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        mesh.vertices[v] = meshing::to_position(minus(mesh.place(v), origin));
    mesh.origin = origin;
}

void remove_small_components(TriangleMesh& mesh, double min_volume) {
    DisjointSets components(mesh.triangles.size());
    for_each_edge(mesh, [&](const Side* first, const Side* last) {
        for (const Side* other = first + 1; other != last; ++other)
            components.unite(first->number / 3, other->number / 3);
    });
    std::vector<double> volumes(mesh.triangles.size(), 0.0);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        const std::uint32_t root = components.root(t);
        volumes[root] += six_volumes(mesh, mesh.triangles[t], point(mesh, mesh.triangles[root][0])) / 6;
    }
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
        if (std::abs(volumes[components.root(t)]) < min_volume) mesh.triangles[t].fill(meshing::CornerTable::kNone);
    meshing::remove_gone(mesh.triangles, mesh.vertices);
}

}  // namespace covol
