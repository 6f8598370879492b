#include "cloud/surface/sharp_mesh.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "base/geometry.h"
#include "mesh/corner_table.h"

namespace covol {
namespace cloud {
namespace {

// [voxels] Maximum distance of a vertex from the surface that a crease's sheets form, for it to be moved to the crease
// or for its edges to be divided there.
constexpr double kOnSurface = 1;
// [voxels] Maximum difference between the distances of a vertex to two sheets, for it to be moved to one or both.
constexpr double kBeside = 2;
// [voxels] Maximum difference between the distances of a vertex to two sheets, for it to be moved onto their crease.
// Also the distance from a vertex at a corner below which vertices are merged with it.
constexpr double kOnCrease = 0.3;
// [voxels] Maximum difference between the distances of a vertex to two sheets, for it to count as lying on both.
constexpr double kSame = 0.02;
// [voxels] Maximum distance of a vertex's new position on a crease from its old one or from an estimate of the new one.
constexpr double kLongestMove = 1.5;

constexpr double kNeedle = 0.2;       // [voxels] maximum length of a degenerate triangle's edge that is collapsed
constexpr double kLineHeight = 0.02;  // [voxels] height below which a triangle counts as degenerate
constexpr int kMendings = 10;         // maximum number of passes until no triangle is folded or flat

std::vector<Vec3> feet_of(const std::vector<Quadric>& quadrics) {
    std::vector<Vec3> feet;
    feet.reserve(quadrics.size());
    for (const Quadric& q : quadrics) feet.push_back(q.foot());
    return feet;
}

/// A point near `from` at which the given sheets meet, by Newton's method; none if it is farther away than `longest`.
/// @param sheets  one bit for each sheet of the crease
std::optional<Vec3> meeting(const Crease& crease, unsigned sheets, const Vec3& from, double longest) {
    Vec3 at = from;
    for (int step = 0; step < 5; ++step) {
        Eigen::Matrix<double, 3, 3> normals = Eigen::Matrix3d::Zero();
        Eigen::Vector3d off = Eigen::Vector3d::Zero();
        int count = 0;
        for (std::size_t s = 0; s < crease.count; ++s)
            if ((sheets >> s & 1U) != 0) {
                const Vec3 n = crease.sheets[s].normal(at);
                normals.row(count) = Eigen::Vector3d(n[0], n[1], n[2]);
                off[count++] = crease.sheets[s].distance(at);
            }
        // The shortest step that satisfies the linearised equations is a combination of the normals.
        Eigen::Matrix3d gram = normals * normals.transpose();
        for (int a = count; a < 3; ++a) gram(a, a) = 1;
        for (int a = 0; a < count; ++a) gram(a, a) += 1e-9;
        const Eigen::Vector3d move = normals.transpose() * gram.ldlt().solve(-off);
        for (int a = 0; a < 3; ++a) at[a] += move[a];
        if (!move.allFinite()) return {};
    }
    if (!(length(minus(at, from)) < longest)) return {};
    return at;
}

class Sharpener {
public:
    Sharpener(TriangleMesh& mesh, const Creases& creases, double h) : mesh_(mesh), creases_(creases), h_(h) {}

    std::size_t run() {
        move_vertices();
        find_divisions();
        if (!divided_.empty()) divide_triangles();
        insert_corners();
        mend();
        return divided_.size();
    }

private:
    using Edge = std::pair<std::uint32_t, std::uint32_t>;
    static Edge edge(std::uint32_t a, std::uint32_t b) { return {std::min(a, b), std::max(a, b)}; }

    void put(std::size_t vertex, const Vec3& place) {
        for (std::size_t a = 0; a < 3; ++a) mesh_.vertices[vertex][a] = float(place[a] - mesh_.origin[a]);
    }

    std::uint32_t add(const Vec3& place) {
        mesh_.vertices.emplace_back();
        put(mesh_.vertices.size() - 1, place);
        return std::uint32_t(mesh_.vertices.size() - 1);
    }

    void move_vertices() {
        near_.assign(mesh_.vertices.size(), 0);
        tbb::parallel_for(std::size_t(0), near_.size(), [&](std::size_t v) {
            const Vec3 place = mesh_.place(v);
            const Crease* crease = creases_.nearest(place);
            if (crease == nullptr || !(std::abs(crease->distance(place)) < kOnSurface * h_)) return;
            near_[v] = 1;
            if (std::has_single_bit(crease->sheets_at(place, kBeside * h_))) return;
            const unsigned on = crease->sheets_at(place, kOnCrease * h_);
            std::optional<Vec3> moved = meeting(*crease, on, place, kLongestMove * h_);
            // A point on two sheets need not be on the surface that the crease's sheets form, for example if the third
            // sheet cuts it off. The vertex is then moved to its own sheet only.
            if (!moved || std::abs(crease->distance(*moved)) > kSame * h_)
                moved = meeting(*crease, 1U << crease->nearest(place), place, kLongestMove * h_);
            if (moved) put(v, *moved);
        });
    }

    /// The point at which the edge between two vertices crosses a crease, if it does.
    std::optional<Vec3> division(std::uint32_t a, std::uint32_t b) const {
        const Vec3 from = mesh_.place(a), to = mesh_.place(b), middle = times(0.5, plus(from, to));
        const Crease* crease = creases_.nearest(middle);
        if (crease == nullptr) return {};
        const unsigned at_a = crease->sheets_at(from, kSame * h_), at_b = crease->sheets_at(to, kSame * h_);
        if ((at_a & at_b) != 0) return {};
        for (const Vec3* end : {&from, &to})
            if (!(std::abs(crease->distance(*end)) < kOnSurface * h_)) return {};
        const unsigned both = 1U << crease->nearest(from) | 1U << crease->nearest(to);
        std::optional<Vec3> at = meeting(*crease, both, middle, kLongestMove * h_);
        if (at && std::abs(crease->distance(*at)) > kSame * h_) return {};
        return at;
    }

    void find_divisions() {
        std::vector<Edge> edges;
        for (const auto& t : mesh_.triangles)
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t a = t[k], b = t[(k + 1) % 3];
                if (near_[a] && near_[b]) edges.push_back(edge(a, b));
            }
        std::sort(edges.begin(), edges.end());
        edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
        std::vector<std::optional<Vec3>> at(edges.size());
        tbb::parallel_for(std::size_t(0), edges.size(),
                          [&](std::size_t n) { at[n] = division(edges[n].first, edges[n].second); });
        for (std::size_t n = 0; n < edges.size(); ++n)
            if (at[n]) divided_.emplace_hint(divided_.end(), edges[n], add(*at[n]));
    }

    void divide_triangles() {
        constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
        const std::size_t count = mesh_.triangles.size();
        for (std::size_t n = 0; n < count; ++n) {
            std::array<std::uint32_t, 3> t = mesh_.triangles[n], on{};
            if (near_[t[0]] + near_[t[1]] + near_[t[2]] < 2) continue;
            int divided = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const auto found = divided_.find(edge(t[k], t[(k + 1) % 3]));
                on[k] = found == divided_.end() ? kNone : found->second;
                divided += found != divided_.end();
            }
            if (divided == 0) continue;
            // Rotates the triangle such that its first edge is divided and, if two edges are, these are the first and
            // the last one.
            while (on[0] == kNone || (divided == 2 && on[2] == kNone)) {
                std::rotate(t.begin(), t.begin() + 1, t.end());
                std::rotate(on.begin(), on.begin() + 1, on.end());
            }
            if (divided == 1) {
                replace(n, {{{t[0], on[0], t[2]}, {on[0], t[1], t[2]}}});
            } else if (divided == 2) {
                const bool first = length(minus(mesh_.place(on[0]), mesh_.place(t[2]))) <
                                   length(minus(mesh_.place(on[2]), mesh_.place(t[1])));
                if (first)
                    replace(n, {{t[0], on[0], on[2]}, {on[0], t[1], t[2]}, {on[0], t[2], on[2]}});
                else
                    replace(n, {{t[0], on[0], on[2]}, {on[0], t[1], on[2]}, {t[1], t[2], on[2]}});
            } else {
                replace(n, {{t[0], on[0], on[2]}, {on[0], t[1], on[1]}, {on[1], t[2], on[2]}, {on[0], on[1], on[2]}});
            }
        }
    }

    [[nodiscard]] bool is_near(std::uint32_t vertex) const { return vertex >= near_.size() || near_[vertex] != 0; }

    /// Inserts a vertex where three sheets meet, in each triangle whose vertices have no sheet in common.
    void insert_corners() {
        std::vector<Vec3> corners;
        const std::size_t count = mesh_.triangles.size();
        for (std::size_t n = 0; n < count; ++n) {
            const std::array<std::uint32_t, 3> t = mesh_.triangles[n];
            if (!is_near(t[0]) || !is_near(t[1]) || !is_near(t[2])) continue;
            Vec3 middle{0, 0, 0};
            for (const std::uint32_t v : t) middle = plus(middle, 1.0 / 3, mesh_.place(v));
            const Crease* crease = creases_.nearest(middle);
            if (crease == nullptr || crease->count < 3) continue;
            unsigned common = 7U;
            for (const std::uint32_t v : t) common &= crease->sheets_at(mesh_.place(v), kSame * h_);
            if (common != 0) continue;
            const std::optional<Vec3> corner = meeting(*crease, 7U, middle, kLongestMove * h_);
            if (!corner || std::abs(crease->distance(*corner)) > kSame * h_ ||
                std::any_of(corners.begin(), corners.end(),
                            [&](const Vec3& other) { return length(minus(other, *corner)) < 0.5 * h_; }))
                continue;
            corners.push_back(*corner);
            const std::uint32_t c = add(*corner);
            replace(n, {{t[0], t[1], c}, {t[1], t[2], c}, {t[2], t[0], c}});
        }
    }

    /// Vertices on a crease may have passed each other, and all three vertices of a triangle may lie on it. The longest
    /// edge of such a degenerate triangle is flipped or its shortest edge collapsed, and vertices of triangles that
    /// face the wrong way move to the mean of their neighbours on the crease.
    void mend() {
        meshing::CornerTable table(mesh_.triangles, mesh_.vertices.size());
        for (std::uint32_t v = 0; v < table.vertices(); ++v)
            if (is_near(v) && count_sheets(v) == 3) clear_around(table, v);
        bool any = true;
        for (int turn = 0; turn < kMendings && any; ++turn) {
            std::vector<char> is_bad(mesh_.triangles.size());
            tbb::parallel_for(std::size_t(0), is_bad.size(),
                              [&](std::size_t n) { is_bad[n] = is_line(n) || faces_back(n); });
            any = false;
            for (std::uint32_t n = 0; n < is_bad.size(); ++n) {
                if (is_bad[n] == 0) continue;
                any = true;
                if (is_line(n))
                    straighten(table, n);
                else if (faces_back(n))
                    for (std::uint32_t k = 0; k < 3; ++k) smooth_along_crease(table, table.vertex(3 * n + k));
            }
        }
        meshing::remove_gone(mesh_.triangles, mesh_.vertices);
    }

    /// Collapses edges from a vertex at a corner to vertices that are so close that edges between the corner's creases
    /// would cut the corner off.
    void clear_around(meshing::CornerTable& table, std::uint32_t vertex) {
        for (bool any = true; any;) {
            std::uint32_t close = meshing::CornerTable::kNone;
            table.around(vertex, [&](std::uint32_t corner) {
                const std::uint32_t other = table.vertex(table.next(corner)), facing = table.previous(corner);
                if (length(minus(mesh_.place(other), mesh_.place(vertex))) < kOnCrease * h_ &&
                    table.can_collapse(facing))
                    close = facing;
            });
            any = close != meshing::CornerTable::kNone;
            if (any) table.collapse(close);
        }
    }

    void straighten(meshing::CornerTable& table, std::uint32_t triangle) {
        const Shape shape = shape_of(mesh_.triangles[triangle]);
        if (shape.shortest < kNeedle * h_) {
            std::uint32_t corner = 3 * triangle + shape.at_shortest;
            const std::uint32_t across = table.opposite(corner), kept = table.vertex(table.next(corner)),
                                gone = table.vertex(table.previous(corner));
            // Of the two vertices, that on more sheets is kept, so that vertices on creases and at corners remain.
            if (across != meshing::CornerTable::kNone && count_sheets(gone) > count_sheets(kept)) corner = across;
            if (table.can_collapse(corner)) return table.collapse(corner);
        }
        const std::uint32_t apex = 3 * triangle + shape.at_longest, across = table.opposite(apex);
        if (across != meshing::CornerTable::kNone && !is_line(across / 3) && table.can_flip(apex)) table.flip(apex);
    }

    [[nodiscard]] int count_sheets(std::uint32_t vertex) const {
        const Vec3 place = mesh_.place(vertex);
        const Crease* crease = creases_.nearest(place);
        return crease == nullptr ? 0 : std::popcount(crease->sheets_at(place, kSame * h_));
    }

    struct Shape {
        std::uint32_t at_longest, at_shortest;  ///< corners (0 to 2) opposite to the longest and the shortest edge
        double shortest;                        ///< length of the shortest edge
        double height;                          ///< over the longest edge
    };

    [[nodiscard]] Shape shape_of(const std::array<std::uint32_t, 3>& t) const {
        Shape shape{};
        double longest = 0;
        shape.shortest = std::numeric_limits<double>::infinity();
        for (std::uint32_t k = 0; k < 3; ++k) {
            const double edge = length(minus(mesh_.place(t[(k + 2) % 3]), mesh_.place(t[(k + 1) % 3])));
            if (edge > longest) longest = edge, shape.at_longest = k;
            if (edge < shape.shortest) shape.shortest = edge, shape.at_shortest = k;
        }
        const Vec3 first = minus(mesh_.place(t[1]), mesh_.place(t[0])),
                   second = minus(mesh_.place(t[2]), mesh_.place(t[0]));
        shape.height = longest > 0 ? length(cross(first, second)) / longest : 0;
        return shape;
    }

    [[nodiscard]] bool is_line(std::size_t triangle) const {
        const auto& t = mesh_.triangles[triangle];
        return !is_gone(triangle) && is_near(t[0]) && is_near(t[1]) && is_near(t[2]) &&
               shape_of(t).height < kLineHeight * h_;
    }

    [[nodiscard]] bool is_gone(std::size_t triangle) const {
        return mesh_.triangles[triangle][0] == meshing::CornerTable::kNone;
    }

    [[nodiscard]] bool faces_back(std::size_t triangle) const {
        if (is_gone(triangle)) return false;
        const auto& t = mesh_.triangles[triangle];
        std::array<Vec3, 3> corner;
        Vec3 middle{0, 0, 0};
        for (std::size_t k = 0; k < 3; ++k) {
            corner[k] = mesh_.place(t[k]);
            middle = plus(middle, 1.0 / 3, corner[k]);
        }
        const Crease* crease = creases_.nearest(middle);
        if (crease == nullptr || !(std::abs(crease->distance(middle)) < kSame * h_)) return false;
        const Vec3 normal = cross(minus(corner[1], corner[0]), minus(corner[2], corner[0]));
        return dot(normal, crease->sheets[crease->nearest(middle)].normal(middle)) < 0;
    }

    void smooth_along_crease(const meshing::CornerTable& table, std::uint32_t vertex) {
        const Vec3 place = mesh_.place(vertex);
        const Crease* crease = creases_.nearest(place);
        if (crease == nullptr) return;
        const unsigned sheets = crease->sheets_at(place, kSame * h_);
        if (sheets == 7U) return;  // a corner
        Vec3 sum{0, 0, 0};
        int count = 0;
        table.around(vertex, [&](std::uint32_t corner) {
            const Vec3 at = mesh_.place(table.vertex(meshing::CornerTable::next(corner)));
            if ((crease->sheets_at(at, kSame * h_) & sheets) != sheets) return;
            sum = plus(sum, at);
            ++count;
        });
        if (count == 0) return;
        if (const std::optional<Vec3> moved = meeting(*crease, sheets, times(1.0 / count, sum), kLongestMove * h_))
            put(vertex, *moved);
    }

    void replace(std::size_t n, const std::vector<std::array<std::uint32_t, 3>>& by) {
        mesh_.triangles[n] = by.front();
        mesh_.triangles.insert(mesh_.triangles.end(), by.begin() + 1, by.end());
    }

    TriangleMesh& mesh_;
    const Creases& creases_;
    double h_;
    std::vector<char> near_;                 // for each vertex, whether it is near a crease
    std::map<Edge, std::uint32_t> divided_;  // the vertex that divides each edge
};

}  // namespace

std::size_t sharpen(TriangleMesh& mesh, const Creases& creases, double h) { return Sharpener(mesh, creases, h).run(); }

}  // namespace cloud

Creases::Creases(std::vector<cloud::Quadric> quadrics, std::vector<double> reach)
    : quadrics_(std::move(quadrics)),
      reach_(std::move(reach)),
      longest_(reach_.empty() ? 1 : *std::max_element(reach_.begin(), reach_.end())),
      cells_(cloud::feet_of(quadrics_), longest_) {}

const cloud::Crease* Creases::nearest(const Vec3& place) const {
    thread_local std::vector<cloud::PointCells::Range> ranges;
    cells_.find(place, longest_, ranges);
    double smallest = std::numeric_limits<double>::infinity();
    const cloud::Crease* found = nullptr;
    for (const cloud::PointCells::Range& range : ranges)
        for (std::uint32_t at = range.begin; at < range.end; ++at) {
            const Vec3 to = minus(cells_.sorted()[at], place);
            const double squared = dot(to, to);
            const std::uint32_t n = cells_.order()[at];
            if (squared >= smallest || squared >= reach_[n] * reach_[n]) continue;
            smallest = squared;
            found = quadrics_[n].crease.get();
        }
    return found;
}

}  // namespace covol
