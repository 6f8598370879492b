#include "holes/cut.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/heuristics.h"
#include "holes/heuristics.h"
#include "mesh/triangle.h"

namespace covol::holes {
namespace {

using Point = std::array<float, 3>;
using Triangle = std::array<std::uint32_t, 3>;

Point between(const Point& a, const Point& b, float t) {
    Point p;
    for (int c = 0; c < 3; ++c) p[c] = a[c] + t * (b[c] - a[c]);
    return p;
}

double squared_length(const Point& a, const Point& b) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) sum += (double(a[c]) - b[c]) * (double(a[c]) - b[c]);
    return sum;
}

bool turns(const Vec3& a, const Vec3& b) { return dot(a, b) < kCommon.turn * std::sqrt(dot(a, a) * dot(b, b)); }

/// Moves vertices close to the line of value 0 onto it. A move is undone if a triangle would turn by too much (see
/// turns()); the value of the vertex becomes 0 even then, so that the cut passes through the vertex.
void snap(const TriangleMesh& mesh, std::vector<Point>& vertices, std::vector<float>& values) {
    std::vector<float> closest(values.size(), kCut.close);
    std::vector<Point> moved = vertices;
    for (const Triangle& t : mesh.triangles)
        for (int k = 0; k < 3; ++k)
            for (const auto& [from, to] : {std::pair{t[k], t[(k + 1) % 3]}, {t[(k + 1) % 3], t[k]}}) {
                if ((values[from] > 0) == (values[to] > 0) || values[from] == 0 || values[to] == 0) continue;
                const float fraction = values[from] / (values[from] - values[to]);
                if (fraction >= closest[from]) continue;
                closest[from] = fraction;
                moved[from] = between(vertices[from], vertices[to], fraction);
            }
    std::vector<Point> tried = vertices;
    std::vector<char> moves(values.size());
    for (std::size_t v = 0; v < values.size(); ++v) {
        moves[v] = closest[v] < kCut.close;
        if (!moves[v]) continue;
        values[v] = 0;
        tried[v] = moved[v];
    }
    for (bool undone = true; undone;) {  // ends, because each round undoes at least one move
        undone = false;
        for (const Triangle& t : mesh.triangles) {
            if (!moves[t[0]] && !moves[t[1]] && !moves[t[2]]) continue;
            if (!turns(meshing::area_normal(vertices, t), meshing::area_normal(tried, t))) continue;
            for (const std::uint32_t v : t) {
                undone = undone || moves[v];
                moves[v] = 0;
                tried[v] = vertices[v];
            }
        }
    }
    vertices = std::move(tried);
}

/// Divides the triangles of a mesh along the line on which the value is 0.
class Splitter {
public:
    Splitter(const TriangleMesh& mesh, std::vector<float> values) : values_(std::move(values)) {
        cut_.mesh.vertices = mesh.vertices;
        cut_.mesh.origin = mesh.origin;
        snap(mesh, cut_.mesh.vertices, values_);
        for (const Triangle& t : mesh.triangles) split(t);
    }
    [[nodiscard]] CutMesh result() { return std::move(cut_); }

private:
    [[nodiscard]] int sign(std::uint32_t v) const { return values_[v] > 0 ? 1 : values_[v] < 0 ? -1 : 0; }

    void add(std::uint32_t a, std::uint32_t b, std::uint32_t c, bool kept) {
        cut_.mesh.triangles.push_back({a, b, c});
        cut_.kept.push_back(kept);
    }

    /// The vertex at the crossing of the line with the edge from a to b, which is added once.
    std::uint32_t crossing(std::uint32_t a, std::uint32_t b) {
        if (a > b) std::swap(a, b);
        const auto [at, is_new] = crossings_.try_emplace({a, b}, std::uint32_t(cut_.mesh.vertices.size()));
        if (is_new)
            cut_.mesh.vertices.push_back(
                between(cut_.mesh.vertices[a], cut_.mesh.vertices[b], values_[a] / (values_[a] - values_[b])));
        return at->second;
    }

    void split(Triangle t) {
        const int signs = sign(t[0]) * sign(t[0]) + sign(t[1]) * sign(t[1]) + sign(t[2]) * sign(t[2]);
        const int sum = sign(t[0]) + sign(t[1]) + sign(t[2]);
        if (std::abs(sum) == signs) return add(t[0], t[1], t[2], sum > 0);
        // Rotate such that the corner alone on its side, or on the line, comes first.
        const auto is_first = [&](const Triangle& c) {
            return signs == 2 ? sign(c[0]) == 0 : sign(c[0]) == -sign(c[1]) && sign(c[1]) == sign(c[2]);
        };
        while (!is_first(t)) std::rotate(t.begin(), t.begin() + 1, t.end());
        if (signs == 2) {
            const std::uint32_t x = crossing(t[1], t[2]);
            add(t[0], t[1], x, sign(t[1]) > 0);
            return add(t[0], x, t[2], sign(t[2]) > 0);
        }
        const std::uint32_t x = crossing(t[0], t[1]), y = crossing(t[2], t[0]);
        const bool kept = sign(t[0]) > 0;
        add(t[0], x, y, kept);
        const auto& at = cut_.mesh.vertices;
        if (squared_length(at[x], at[t[2]]) < squared_length(at[y], at[t[1]])) {
            add(x, t[1], t[2], !kept);
            add(x, t[2], y, !kept);
        } else {
            add(x, t[1], y, !kept);
            add(t[1], t[2], y, !kept);
        }
    }

    std::vector<float> values_;
    CutMesh cut_;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> crossings_;
};

/// Gives each fan of triangles around a vertex its own copy of the vertex.
void separate_fans(TriangleMesh& mesh) {
    std::vector<std::vector<std::uint32_t>> around(mesh.vertices.size());  // by vertex: corners, 3 t + k in triangle t
    for (std::uint32_t c = 0; c < 3 * mesh.triangles.size(); ++c) around[mesh.triangles[c / 3][c % 3]].push_back(c);
    const auto next = [&](std::uint32_t c, std::uint32_t by) { return mesh.triangles[c / 3][(c % 3 + by) % 3]; };
    const std::size_t count = around.size();
    for (std::size_t v = 0; v < count; ++v) {
        std::vector<std::uint32_t>& left = around[v];
        for (bool first = true; !left.empty(); first = false) {
            std::vector<std::uint32_t> fan{left.back()};
            left.pop_back();
            for (std::size_t n = 0; n < fan.size(); ++n)
                for (std::size_t m = left.size(); m-- > 0;)
                    if (next(fan[n], 1) == next(left[m], 2) || next(fan[n], 2) == next(left[m], 1)) {
                        fan.push_back(left[m]);
                        left.erase(left.begin() + std::ptrdiff_t(m));
                    }
            if (first) continue;
            for (const std::uint32_t c : fan) mesh.triangles[c / 3][c % 3] = std::uint32_t(mesh.vertices.size());
            mesh.vertices.push_back(mesh.vertices[v]);
        }
    }
}

}  // namespace

CutMesh cut_along(const TriangleMesh& mesh, std::vector<float> values) {
    return Splitter(mesh, std::move(values)).result();
}

TriangleMesh kept_part(const CutMesh& cut) {
    TriangleMesh part{cut.mesh.vertices, {}, cut.mesh.origin};
    for (std::size_t t = 0; t < cut.kept.size(); ++t)
        if (cut.kept[t]) part.triangles.push_back(cut.mesh.triangles[t]);
    separate_fans(part);
    remove_small_components(part, 0);  // removes unused vertices
    return part;
}

}  // namespace covol::holes
