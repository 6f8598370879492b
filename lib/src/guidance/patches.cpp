#include "guidance/patches.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>

#include "points/kd_tree.h"

namespace covol::guidance {
namespace {

Vec3 unit(const Vec3& v, const Vec3& fallback) {
    const double n = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    return n > 1e-12 ? Vec3{v[0] / n, v[1] / n, v[2] / n} : fallback;
}

/// Neighbours of each vertex in compressed rows, each once.
struct Rows {
    std::vector<std::uint32_t> first, other;
    explicit Rows(const TriangleMesh& mesh) : first(mesh.vertices.size() + 1, 0) {
        for (const auto& t : mesh.triangles)
            for (int c = 0; c < 3; ++c) ++first[t[c] + 1];
        std::partial_sum(first.begin(), first.end(), first.begin());
        other.resize(first.back());
        std::vector<std::uint32_t> fill(first.begin(), first.end() - 1);
        // In a closed surface every edge leaves each of its ends in exactly one triangle.
        for (const auto& t : mesh.triangles)
            for (int c = 0; c < 3; ++c) other[fill[t[c]]++] = t[(c + 1) % 3];
    }
};

void smooth_normals(std::vector<Vec3>& normals, const Rows& rows, int rounds) {
    std::vector<Vec3> next(normals.size());
    for (int round = 0; round < rounds; ++round) {
        tbb::parallel_for(std::size_t(0), normals.size(), [&](std::size_t v) {
            Vec3 sum = normals[v];
            for (std::uint32_t n = rows.first[v]; n < rows.first[v + 1]; ++n)
                for (int a = 0; a < 3; ++a) sum[a] += normals[rows.other[n]][a];
            next[v] = unit(sum, normals[v]);
        });
        normals.swap(next);
    }
}

}  // namespace

double voxel_along(const ImageGeometry& g, const Vec3& d) {
    double sum = 0;
    for (int a = 0; a < 3; ++a) {
        const double along =
            (d[0] * g.direction[0][a] + d[1] * g.direction[1][a] + d[2] * g.direction[2][a]) * g.spacing[a];
        sum += along * along;
    }
    return std::sqrt(sum);
}

Patches make_patches(const TriangleMesh& mesh, const ImageGeometry& g, double width, int smooth) {
    Patches p;
    const std::size_t count = mesh.vertices.size();
    p.places.resize(count);
    p.normals.resize(count);
    const auto normals = compute_vertex_normals(mesh);
    tbb::parallel_for(std::size_t(0), count, [&](std::size_t v) {
        p.places[v] = mesh.place(v);
        for (int a = 0; a < 3; ++a) p.normals[v][a] = normals[v][a];
    });
    const Rows rows(mesh);
    smooth_normals(p.normals, rows, smooth);

    // A cell of the image's lattice, and which way the surface faces: the two sides of a sheet are two patches.
    using Key = std::array<std::int32_t, 4>;
    std::vector<std::pair<Key, std::uint32_t>> keys(count);
    std::array<double, 3> cell;
    for (int a = 0; a < 3; ++a) cell[a] = std::max(width / g.spacing[a], 1.0);
    tbb::parallel_for(std::size_t(0), count, [&](std::size_t v) {
        const Vec3 at = g.world_to_index(p.places[v]);
        Key key;
        for (int a = 0; a < 3; ++a) key[a] = int(std::floor(at[a] / cell[a]));
        int axis = 0;
        for (int a = 1; a < 3; ++a)
            if (std::abs(p.normals[v][a]) > std::abs(p.normals[v][axis])) axis = a;
        key[3] = 2 * axis + (p.normals[v][axis] > 0);
        keys[v] = {key, std::uint32_t(v)};
    });
    tbb::parallel_sort(keys.begin(), keys.end());
    p.patch.resize(count);
    for (std::size_t n = 0; n < count; ++n) {
        if (n == 0 || keys[n].first != keys[n - 1].first) p.first.push_back(std::uint32_t(n));
        p.members.push_back(keys[n].second);
        p.patch[keys[n].second] = std::uint32_t(p.first.size() - 1);
    }
    const std::size_t patches = p.first.size();
    p.first.push_back(std::uint32_t(count));

    std::vector<double> vertex_area(count, 0);
    for (const auto& t : mesh.triangles) {
        const Vec3 &a = p.places[t[0]], &b = p.places[t[1]], &c = p.places[t[2]];
        const Vec3 u{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, w{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
        const double area =
            0.5 * std::hypot(u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]);
        for (int n = 0; n < 3; ++n) vertex_area[t[n]] += area / 3;
    }
    p.centers.assign(patches, {0, 0, 0});
    p.directions.assign(patches, {0, 0, 0});
    p.area.assign(patches, 0);
    p.voxel.resize(patches);
    for (std::size_t i = 0; i < patches; ++i) {
        for (std::uint32_t n = p.first[i]; n < p.first[i + 1]; ++n) {
            const std::uint32_t v = p.members[n];
            for (int a = 0; a < 3; ++a) {
                p.centers[i][a] += p.places[v][a];
                p.directions[i][a] += p.normals[v][a];
            }
            p.area[i] += vertex_area[v];
        }
        for (int a = 0; a < 3; ++a) p.centers[i][a] /= p.first[i + 1] - p.first[i];
        p.directions[i] = unit(p.directions[i], p.normals[p.members[p.first[i]]]);
        p.voxel[i] = voxel_along(g, p.directions[i]);
    }

    // The border between two patches crosses the edges that join them, each about an edge's length of it.
    std::vector<std::tuple<std::uint32_t, std::uint32_t, float>> crossing;
    for (std::size_t v = 0; v < count; ++v)
        for (std::uint32_t n = rows.first[v]; n < rows.first[v + 1]; ++n) {
            const std::uint32_t a = p.patch[v], b = p.patch[rows.other[n]];
            if (a < b)
                crossing.emplace_back(a, b,
                                      float(std::sqrt(detail::squared_distance(p.places[v], p.places[rows.other[n]]))));
            if (b < a)
                crossing.emplace_back(b, a,
                                      float(std::sqrt(detail::squared_distance(p.places[v], p.places[rows.other[n]]))));
        }
    tbb::parallel_sort(crossing.begin(), crossing.end());
    for (const auto& [a, b, length] : crossing) {
        if (p.borders.empty() || p.borders.back().a != a || p.borders.back().b != b)
            p.borders.push_back({a, b, 0, std::sqrt(detail::squared_distance(p.centers[a], p.centers[b]))});
        // Each edge was met from both ends; on a triangle lattice 1/sqrt(3) of its length is the border's.
        p.borders.back().length += 0.5 * length / std::sqrt(3.0);
    }
    p.neighbours.resize(p.size());
    for (const Patches::Border& border : p.borders) {
        p.neighbours[border.a].push_back(border.b);
        p.neighbours[border.b].push_back(border.a);
    }
    return p;
}

}  // namespace covol::guidance
