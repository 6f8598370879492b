#include "guidance/patches.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <numeric>
#include <tuple>
#include <utility>

#include "mesh/triangle.h"
#include "points/kd_tree.h"

namespace covol::guidance {
namespace {

Vec3 unit(const Vec3& v, const Vec3& fallback) {
    const double n = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    return n > 1e-12 ? Vec3{v[0] / n, v[1] / n, v[2] / n} : fallback;
}

void smooth_normals(SurfaceVertices& surface, int rounds) {
    std::vector<Vec3>& normals = surface.normals;
    std::vector<Vec3> smoothed(normals.size());
    for (int round = 0; round < rounds; ++round) {
        tbb::parallel_for(std::size_t(0), normals.size(), [&](std::size_t v) {
            Vec3 sum = normals[v];
            for (std::uint32_t n = surface.first[v]; n < surface.first[v + 1]; ++n)
                for (int a = 0; a < 3; ++a) sum[a] += normals[surface.neighbours[n]][a];
            smoothed[v] = unit(sum, normals[v]);
        });
        normals.swap(smoothed);
    }
}

/// Sorts vertices by the cell of a lattice along the image's axes and by the axis direction closest to their normals:
/// the two sides of a thin body belong to separate patches.
struct VertexKey {
    std::uint64_t ij, k_face;
    std::uint32_t vertex;
    auto operator<=>(const VertexKey&) const = default;
    [[nodiscard]] bool is_with(const VertexKey& other) const { return ij == other.ij && k_face == other.k_face; }
};

}  // namespace

std::vector<double> on_vertices(const Patches& patches, double width, const std::vector<double>& by_patch) {
    std::vector<double> result(patches.places.size());
    tbb::parallel_for(std::size_t(0), result.size(), [&](std::size_t v) {
        const std::uint32_t own = patches.patch[v];
        double sum = 0, total = 0;
        const auto add = [&](std::uint32_t i) {
            const double away2 = detail::squared_distance(patches.places[v], patches.centers[i]),
                         weight = std::exp(-away2 / (width * width)) + 1e-12;
            sum += weight * by_patch[i];
            total += weight;
        };
        add(own);
        for (const std::uint32_t i : patches.neighbours[own]) add(i);
        result[v] = sum / total;
    });
    return result;
}

double voxel_along(const ImageGeometry& g, const Vec3& d) {
    double sum = 0;
    for (int a = 0; a < 3; ++a) {
        const double along =
            (d[0] * g.direction[0][a] + d[1] * g.direction[1][a] + d[2] * g.direction[2][a]) * g.spacing[a];
        sum += along * along;
    }
    return std::sqrt(sum);
}

SurfaceVertices vertices_of(const TriangleMesh& mesh, double smooth) {
    SurfaceVertices surface;
    const std::size_t count = mesh.vertices.size();
    surface.places.resize(count);
    surface.normals.resize(count);
    const auto normals = compute_vertex_normals(mesh);
    tbb::parallel_for(std::size_t(0), count, [&](std::size_t v) {
        surface.places[v] = mesh.place(v);
        for (int a = 0; a < 3; ++a) surface.normals[v][a] = normals[v][a];
    });

    surface.first.assign(count + 1, 0);
    for (const auto& t : mesh.triangles)
        for (int c = 0; c < 3; ++c) ++surface.first[t[c] + 1];
    std::partial_sum(surface.first.begin(), surface.first.end(), surface.first.begin());
    surface.neighbours.resize(surface.first.back());
    std::vector<std::uint32_t> fill(surface.first.begin(), surface.first.end() - 1);
    surface.area.assign(count, 0);
    for (const auto& t : mesh.triangles) {
        const double area =
            length(meshing::area_normal(surface.places[t[0]], surface.places[t[1]], surface.places[t[2]]));
        for (int c = 0; c < 3; ++c) {
            // In a closed surface every directed edge belongs to one triangle, so that each neighbour is added once.
            surface.neighbours[fill[t[c]]++] = t[(c + 1) % 3];
            surface.area[t[c]] += area / 6;
        }
    }
    // A round averages over a vertex and its neighbours, about six at a distance of about 0.9 voxels: the mean squared
    // distance of the vertices that are averaged grows by 2/3, and reaches smooth^2 after 1.5 smooth^2 rounds.
    smooth_normals(surface, int(std::lround(1.5 * smooth * smooth)));
    return surface;
}

Patches cut_patches(const SurfaceVertices& surface, const ImageGeometry& g, double width) {
    Patches p;
    const std::size_t count = surface.places.size();
    std::vector<VertexKey> keys(count);
    std::array<double, 3> cell;
    for (int a = 0; a < 3; ++a) cell[a] = std::max(width / g.spacing[a], 1.0);
    tbb::parallel_for(std::size_t(0), count, [&](std::size_t v) {
        const Vec3 at = g.world_to_index(surface.places[v]);
        std::array<std::uint64_t, 3> number;  // sign bit inverted: sorts like the signed number
        for (int a = 0; a < 3; ++a)
            number[a] = std::uint32_t(std::int32_t(std::floor(at[a] / cell[a]))) ^ (std::uint32_t(1) << 31);
        int axis = 0;
        for (int a = 1; a < 3; ++a)
            if (std::abs(surface.normals[v][a]) > std::abs(surface.normals[v][axis])) axis = a;
        const auto face = std::uint64_t(2 * axis + (surface.normals[v][axis] > 0));
        keys[v] = {number[0] << 32 | number[1], number[2] << 32 | face, std::uint32_t(v)};
    });
    tbb::parallel_sort(keys.begin(), keys.end());
    p.patch.resize(count);
    p.members.resize(count);
    for (std::size_t n = 0; n < count; ++n) {
        if (n == 0 || !keys[n].is_with(keys[n - 1])) p.first.push_back(std::uint32_t(n));
        p.members[n] = keys[n].vertex;
        p.patch[keys[n].vertex] = std::uint32_t(p.first.size() - 1);
    }
    const std::size_t patches = p.first.size();
    p.first.push_back(std::uint32_t(count));

    p.centers.assign(patches, {0, 0, 0});
    p.directions.assign(patches, {0, 0, 0});
    p.area.assign(patches, 0);
    p.voxel.resize(patches);
    tbb::parallel_for(std::size_t(0), patches, [&](std::size_t i) {
        for (std::uint32_t n = p.first[i]; n < p.first[i + 1]; ++n) {
            const std::uint32_t v = p.members[n];
            for (int a = 0; a < 3; ++a) {
                p.centers[i][a] += surface.places[v][a];
                p.directions[i][a] += surface.normals[v][a];
            }
            p.area[i] += surface.area[v];
        }
        for (int a = 0; a < 3; ++a) p.centers[i][a] /= p.first[i + 1] - p.first[i];
        p.directions[i] = unit(p.directions[i], surface.normals[p.members[p.first[i]]]);
        p.voxel[i] = voxel_along(g, p.directions[i]);
    });
    return p;
}

void find_borders(SurfaceVertices&& surface, Patches& p) {
    p.places = std::move(surface.places);
    p.normals = std::move(surface.normals);
    // The border between two patches crosses the edges that join them; each contributes in proportion to its length.
    std::vector<std::tuple<std::uint32_t, std::uint32_t, float>> crossing;
    for (std::size_t v = 0; v < p.places.size(); ++v)
        for (std::uint32_t n = surface.first[v]; n < surface.first[v + 1]; ++n) {
            const std::uint32_t a = p.patch[v], b = p.patch[surface.neighbours[n]];
            if (a == b) continue;
            const double length = std::sqrt(detail::squared_distance(p.places[v], p.places[surface.neighbours[n]]));
            crossing.emplace_back(std::min(a, b), std::max(a, b), float(length));
        }
    tbb::parallel_sort(crossing.begin(), crossing.end());
    for (const auto& [a, b, length] : crossing) {
        if (p.borders.empty() || p.borders.back().a != a || p.borders.back().b != b)
            p.borders.push_back({a, b, 0, std::sqrt(detail::squared_distance(p.centers[a], p.centers[b]))});
        // Each edge was counted from both ends. On a lattice of equilateral triangles the length of the border that
        // crosses an edge is 1/sqrt(3) of the edge's length.
        p.borders.back().length += 0.5 * length / std::sqrt(3.0);
    }
    p.neighbours.resize(p.size());
    for (const Patches::Border& border : p.borders) {
        p.neighbours[border.a].push_back(border.b);
        p.neighbours[border.b].push_back(border.a);
    }
}

}  // namespace covol::guidance
