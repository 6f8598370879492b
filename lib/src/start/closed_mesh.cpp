#include "start/closed_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "mesh/triangle.h"

namespace covol::detail {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// The directed edges that are missing along the rims of holes: for each vertex, the ends of those that begin there. At
/// each vertex as many missing edges begin as end.
std::map<std::uint32_t, std::vector<std::uint32_t>> missing_edges(const TriangleMesh& mesh) {
    std::vector<std::pair<Edge, int>> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (const auto& t : mesh.triangles)
        for (std::size_t c = 0; c < 3; ++c) {
            const std::uint32_t a = t[c], b = t[(c + 1) % 3];
            if (a != b) edges.push_back({std::minmax(a, b), a < b ? 1 : -1});
        }
    std::sort(edges.begin(), edges.end());
    std::map<std::uint32_t, std::vector<std::uint32_t>> missing;
    for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
        int passed = 0;
        for (end = begin; end < edges.size() && edges[end].first == edges[begin].first; ++end)
            passed += edges[end].second;
        const auto [a, b] = edges[begin].first;
        for (; passed > 0; --passed) missing[b].push_back(a);
        for (; passed < 0; ++passed) missing[a].push_back(b);
    }
    return missing;
}

double area_of(const TriangleMesh& mesh, std::size_t first) {
    double area = 0;
    for (std::size_t n = first; n < mesh.triangles.size(); ++n) {
        const Vec3 normal = meshing::area_normal(mesh.vertices, mesh.triangles[n]);
        area += 0.5 * std::hypot(normal[0], normal[1], normal[2]);
    }
    return area;
}

/// Closes a hole by a fan of triangles between its rim and the rim's centre.
void add_cap(const std::vector<std::uint32_t>& rim, TriangleMesh& mesh) {
    Vec3 centre{};
    for (const std::uint32_t v : rim)
        for (std::size_t a = 0; a < 3; ++a) centre[a] += double(mesh.vertices[v][a]) / double(rim.size());
    const auto tip = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(meshing::to_position(centre));
    for (std::size_t n = 0; n < rim.size(); ++n) mesh.triangles.push_back({rim[n], rim[(n + 1) % rim.size()], tip});
}

}  // namespace

ClosedMesh close_holes(const TriangleMesh& mesh) {
    ClosedMesh closed{mesh};
    auto missing = missing_edges(mesh);
    const std::size_t given = mesh.triangles.size();
    for (auto& [start, next] : missing)
        while (!next.empty()) {
            // A rim is closed once the path returns to one of its vertices.
            std::vector<std::uint32_t> path{start};
            std::map<std::uint32_t, std::size_t> place{{start, 0}};
            do {
                std::vector<std::uint32_t>& ways = missing[path.back()];
                const std::uint32_t to = ways.back();
                ways.pop_back();
                const auto [met, is_new] = place.try_emplace(to, path.size());
                if (is_new) {
                    path.push_back(to);
                    continue;
                }
                const auto begin = path.begin() + std::ptrdiff_t(met->second);
                add_cap({begin, path.end()}, closed.mesh);
                ++closed.holes;
                for (auto v = begin + 1; v != path.end(); ++v) place.erase(*v);
                path.erase(begin + 1, path.end());
            } while (path.size() > 1);
        }
    const double area = area_of(mesh, 0);
    if (closed.holes > 0 && area > 0) closed.cap_fraction = area_of(closed.mesh, given) / area;
    return closed;
}

}  // namespace covol::detail
