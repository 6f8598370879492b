#include "report/cluster.h"

#include "mesh/triangle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

namespace covol::detail {
namespace {

constexpr double kGrowth = 1.15;  // factor of the cell size per iteration, until the triangles are few enough
// First cell size, as a fraction of the one at which the triangles are expected to be few enough. A smaller fraction
// costs iterations, a larger one detail.
constexpr double kFirstFraction = 0.8;
constexpr std::uint64_t kAxisBits = 21;  // bits of a cell's number for each axis

struct Box {
    std::array<float, 3> min{}, max{};
};

Box box_of(const TriangleMesh& mesh) {
    Box box{mesh.vertices.front(), mesh.vertices.front()};
    for (const auto& v : mesh.vertices)
        for (int a = 0; a < 3; ++a) {
            box.min[a] = std::min(box.min[a], v[a]);
            box.max[a] = std::max(box.max[a], v[a]);
        }
    return box;
}

double area_of(const TriangleMesh& mesh) {
    double area = 0;
    for (const auto& t : mesh.triangles) area += length(meshing::area_normal(mesh.vertices, t)) / 2;
    return area;
}

/// The number of each vertex's cell. Cells are numbered in the order in which they first occur.
struct Cells {
    std::vector<std::uint32_t> of_vertex;
    std::size_t count = 0;
};

Cells cells_of(const TriangleMesh& mesh, const Box& box, double edge) {
    Cells cells;
    cells.of_vertex.reserve(mesh.vertices.size());
    std::unordered_map<std::uint64_t, std::uint32_t> numbers;
    for (const auto& v : mesh.vertices) {
        std::uint64_t key = 0;
        for (int a = 0; a < 3; ++a)
            key = key << kAxisBits | std::uint64_t(std::max(0.0, (double(v[a]) - box.min[a]) / edge));
        cells.of_vertex.push_back(numbers.try_emplace(key, std::uint32_t(numbers.size())).first->second);
    }
    cells.count = numbers.size();
    return cells;
}

/// The triangles whose corners lie in three different cells, as numbers of these cells, without duplicates.
std::vector<std::array<std::uint32_t, 3>> triangles_of(const TriangleMesh& mesh, const Cells& cells) {
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (const auto& t : mesh.triangles) {
        std::array<std::uint32_t, 3> c{cells.of_vertex[t[0]], cells.of_vertex[t[1]], cells.of_vertex[t[2]]};
        if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) continue;
        std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
        triangles.push_back(c);
    }
    std::sort(triangles.begin(), triangles.end());
    triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
    return triangles;
}

/// The mean of the vertices' values in each cell.
std::vector<float> means(const std::vector<float>& values, const Cells& cells) {
    std::vector<double> sum(cells.count);
    std::vector<int> count(cells.count);
    for (std::size_t v = 0; v < values.size(); ++v) {
        sum[cells.of_vertex[v]] += values[v];
        ++count[cells.of_vertex[v]];
    }
    std::vector<float> result(cells.count);
    for (std::size_t c = 0; c < cells.count; ++c) result[c] = float(sum[c] / std::max(1, count[c]));
    return result;
}

/// For each cell the vertex nearest to its mean.
std::vector<std::array<float, 3>> representatives(const TriangleMesh& mesh, const Cells& cells) {
    std::array<std::vector<float>, 3> middle;
    for (int a = 0; a < 3; ++a) {
        std::vector<float> along(mesh.vertices.size());
        for (std::size_t v = 0; v < along.size(); ++v) along[v] = mesh.vertices[v][a];
        middle[a] = means(along, cells);
    }
    std::vector<float> nearest(cells.count, std::numeric_limits<float>::max());
    std::vector<std::array<float, 3>> result(cells.count);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        const std::uint32_t c = cells.of_vertex[v];
        const auto& at = mesh.vertices[v];
        const float away = std::hypot(at[0] - middle[0][c], at[1] - middle[1][c], at[2] - middle[2][c]);
        if (away >= nearest[c]) continue;
        nearest[c] = away;
        result[c] = at;
    }
    return result;
}

}  // namespace

PageMesh cluster(PageMesh in, std::int64_t maximum) {
    const TriangleMesh& mesh = in.mesh;
    if (std::int64_t(mesh.triangles.size()) <= maximum) return in;
    const Box box = box_of(mesh);
    const double longest = std::max({box.max[0] - box.min[0], box.max[1] - box.min[1], box.max[2] - box.min[2]});
    // Cells are at least so large that kAxisBits suffice for their numbers. The loop ends at the latest when one cell
    // contains the whole mesh.
    double edge = std::max(kFirstFraction * std::sqrt(2 * area_of(mesh) / double(maximum)), longest / double(1 << 20));
    if (!(edge > 0) || !std::isfinite(edge)) return in;
    Cells cells = cells_of(mesh, box, edge);
    auto triangles = triangles_of(mesh, cells);
    while (std::int64_t(triangles.size()) > maximum) {
        edge *= kGrowth;
        cells = cells_of(mesh, box, edge);
        triangles = triangles_of(mesh, cells);
    }
    PageMesh out;
    out.mesh.vertices = representatives(mesh, cells);
    out.mesh.triangles = std::move(triangles);
    for (const auto& [name, values] : in.values) out.values.emplace_back(name, means(values, cells));
    return out;
}

}  // namespace covol::detail
