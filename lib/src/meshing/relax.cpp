#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <numeric>
#include <optional>

#include "base/heuristics.h"
#include "covol/mesh_relax.h"
#include "mesh/corner_table.h"
#include "meshing/contacts.h"
#include "meshing/edge_collapser.h"
#include "meshing/heuristics.h"
#include "meshing/level.h"
#include "meshing/safe_moves.h"

namespace covol {
namespace meshing {
namespace {

// Length of a move, as a fraction of the way to the mean of the neighbours. It is the largest one that does not reverse
// an undulation: if a vertex is at height a, the mean of six evenly distributed neighbours is at least at -a/2, and
// a move by 2/3 of the way leads to a height of at least a - 2/3 (a + a/2) = 0.
constexpr double kStep = 2.0 / 3.0;

// Minimum decrease of the smallest angle's cosine by a flip: only prevents endless flips between equal angles.
constexpr double kGain = 1e-3;

class Relaxer {
public:
    Relaxer(TriangleMesh& mesh, const Surface& surface, double tolerance, const RunContext& run)
        : mesh_(mesh),
          table_(mesh.triangles, mesh.vertices.size()),
          finder_(mesh.vertices, mesh.triangles),
          levels_([&surface] { return surface.level(); }),
          holds_(holds_of(table_, mesh.vertices, levels_.local())),
          tolerance_(tolerance),
          run_(run) {}

    /// The first round processes the whole mesh, the others only badly shaped triangles and their surroundings.
    void relax(int rounds, RelaxReport& report) {
        for (int round = 0; round < rounds; ++round) {
            if (round > 0) report.collapses += std::int64_t(collapse_slivers());
            choose(round == 0 ? 2.0 : kRelax.sliver);
            std::vector<Flip> turned = flip_edges();
            const Positions before = mesh_.vertices;
            for (int n = 0; n < kRelax.moves_per_round; ++n) {
                move();
                run_.check();
            }
            undo_contacts(before, turned);
            report.flips += std::int64_t(turned.size());
            run_.report("relax", double(round + 1) / rounds);
            run_.check();
        }
        if (rounds > 0) report.collapses += std::int64_t(collapse_slivers());
    }

private:
    /// Chooses the corners of triangles whose worst_cosine() is above `poor`, their neighbours, and the triangles
    /// around all of these; chooses all if `poor` is above 1.
    void choose(double poor) {
        std::vector<std::uint8_t> vertex(mesh_.vertices.size(), poor > 1), triangle(mesh_.triangles.size(), 0);
        if (poor <= 1) {
            tbb::parallel_for(std::size_t(0), triangle.size(),
                              [&](std::size_t t) { triangle[t] = is_worse(std::uint32_t(t), poor); });
            for (std::size_t t = 0; t < triangle.size(); ++t) {
                if (triangle[t] == 0) continue;
                for (const std::uint32_t v : mesh_.triangles[t]) {
                    vertex[v] = 1;
                    table_.around(v, [&](std::uint32_t c) { vertex[table_.vertex(CornerTable::next(c))] = 1; });
                }
            }
        }
        vertices_.clear();
        for (std::uint32_t v = 0; v < vertex.size(); ++v)
            if (vertex[v] != 0 && table_.corner_of(v) != CornerTable::kNone) vertices_.push_back(v);
        scope_.clear();
        for (std::uint32_t t = 0; t < triangle.size(); ++t)
            if (!table_.is_gone(t) && std::any_of(mesh_.triangles[t].begin(), mesh_.triangles[t].end(),
                                                  [&](std::uint32_t v) { return vertex[v] != 0; }))
                scope_.push_back(t);
    }

    [[nodiscard]] Vec3 at(std::uint32_t v) const { return to_vec3(mesh_.vertices[v]); }
    [[nodiscard]] unsigned face_of(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
        return holds_[a] & holds_[b] & holds_[c] & kFaces;
    }

    /// Whether flipping the edge opposite to the corner increases the smallest angle of its two triangles without
    /// turning them over or moving them off the level set or the faces of the clip.
    [[nodiscard]] bool worth_flipping(std::uint32_t corner) const {
        const std::uint32_t across = table_.opposite(corner);
        if (across == CornerTable::kNone) return false;
        const std::uint32_t a = table_.vertex(CornerTable::next(corner)),
                            b = table_.vertex(CornerTable::previous(corner));
        const std::uint32_t v = table_.vertex(corner), w = table_.vertex(across);
        const Vec3 pa = at(a), pb = at(b), pv = at(v), pw = at(w);
        const double now = std::max(worst_cosine(pv, pa, pb), worst_cosine(pw, pb, pa));
        if (!(std::max(worst_cosine(pv, pa, pw), worst_cosine(pw, pb, pv)) < now - kGain)) return false;
        const Vec3 was[2] = {area_normal(pv, pa, pb), area_normal(pw, pb, pa)};
        const Vec3 is[2] = {area_normal(pv, pa, pw), area_normal(pw, pb, pv)};
        for (const Vec3& m : was)
            for (const Vec3& n : is)
                if (!(dot(m, n) > kCommon.turn * length(m) * length(n))) return false;
        const unsigned face = face_of(v, a, b);
        if (face_of(w, b, a) != face || face_of(v, a, w) != face || face_of(w, b, v) != face) return false;
        if (face != 0) return table_.can_flip(corner);
        const Level& level = levels_.local();
        const double off = std::abs(level.sample(plus(pv, 0.5, minus(pw, pv))).value);
        if (off > kRelax.off_level * level.voxel_size() &&
            off > std::abs(level.sample(plus(pa, 0.5, minus(pb, pa))).value))
            return false;
        if (tolerance_ > 0 && (is_off(pv, pa, pw, 0) || is_off(pw, pb, pv, 0))) return false;
        return table_.can_flip(corner);
    }

    struct Flip {
        std::uint32_t corner, across;  ///< corners opposite to the edge
    };

    /// Flips edges until no flip is worthwhile. @return the flips in the order in which they were made
    std::vector<Flip> flip_edges() {
        std::vector<std::uint8_t> wanted(3 * scope_.size(), 0);
        const auto corner = [&](std::size_t n) { return 3 * scope_[n / 3] + std::uint32_t(n % 3); };
        tbb::parallel_for(std::size_t(0), wanted.size(), [&](std::size_t n) {
            const std::uint32_t c = corner(n), across = table_.opposite(c);
            wanted[n] = across != CornerTable::kNone && c < across && worth_flipping(c);
        });
        std::deque<std::uint32_t> queue;
        for (std::size_t n = 0; n < wanted.size(); ++n)
            if (wanted[n] != 0) queue.push_back(corner(n));
        std::vector<Flip> turned;
        for (; !queue.empty(); queue.pop_front()) {
            const std::uint32_t c = queue.front();
            if (!worth_flipping(c)) continue;
            const std::uint32_t o = table_.opposite(c);
            table_.flip(c);
            turned.push_back({c, o});
            for (const std::uint32_t side : {c, CornerTable::previous(c), o, CornerTable::previous(o)})
                queue.push_back(side);
        }
        return turned;
    }

    /// Undoes the flips that made these triangles, and all flips that depend on them. @return the triangles changed
    std::vector<std::uint32_t> undo_flips(const std::vector<std::uint32_t>& some, std::vector<Flip>& turned) {
        std::vector<std::uint8_t> dirty(mesh_.triangles.size(), 0);
        for (const std::uint32_t t : some) dirty[t] = 1;
        for (bool grown = true; grown;) {  // marks both triangles of a flip as dirty if one of them is
            grown = false;
            for (const Flip& flip : turned) {
                std::uint8_t &s = dirty[flip.corner / 3], &t = dirty[flip.across / 3];
                grown = grown || s != t;
                s = t = s | t;
            }
        }
        std::vector<std::uint32_t> changed;
        for (std::size_t n = turned.size(); n-- > 0;) {
            if (dirty[turned[n].corner / 3] == 0) continue;
            table_.unflip(turned[n].corner);
            changed.push_back(turned[n].corner / 3);
            changed.push_back(turned[n].across / 3);
        }
        std::erase_if(turned, [&](const Flip& flip) { return dirty[flip.corner / 3] != 0; });
        return changed;
    }

    /// The position of a vertex after a step towards the mean of its neighbours; unchanged if it must not move, or if
    /// the new position cannot be projected onto the surface or is too far from it (kRelax.drop).
    [[nodiscard]] Position moved(std::uint32_t v) const {
        const Position& here = mesh_.vertices[v];
        if (holds_[v] & (kFixed | kChamfer)) return here;
        Vec3 sum{}, normal{};
        int count = 0;
        table_.around(v, [&](std::uint32_t c) {
            const Vec3 next = at(table_.vertex(CornerTable::next(c)));
            sum = plus(sum, 1, next);
            normal = plus(normal, 1, area_normal(to_vec3(here), next, at(table_.vertex(CornerTable::previous(c)))));
            ++count;
        });
        const Vec3 p = to_vec3(here);
        Vec3 step = plus(Vec3{}, kStep, minus(plus(Vec3{}, 1.0 / count, sum), p));
        const unsigned held = holds_[v] & kFaces;
        for (int a = 0; a < 3; ++a)
            if (held >> a & 1) step[a] = normal[a] = 0;
        if (!(holds_[v] & kOnLevel)) return to_position(plus(p, 1, step));
        const double size = dot(normal, normal);
        if (!(size > 0)) return here;
        step = plus(step, -dot(step, normal) / size, normal);
        const Vec3 goal = plus(p, 1, step);
        const std::optional<Vec3> found = levels_.local().project(goal, held);
        const double slack = kCommon.same_place * levels_.local().voxel_size();
        if (!found || length(minus(*found, goal)) > kRelax.drop * length(step) + slack) return here;
        Position there = to_position(*found);
        for (int a = 0; a < 3; ++a)
            if (held >> a & 1) there[a] = here[a];
        return there;
    }

    /// Whether a move turns the triangle by more than the angle of kCommon.turn, or moves it off the surface.
    [[nodiscard]] bool is_invalid_move(const Triangle& t, const Positions& before, const Positions& after) const {
        if (is_turned(t, before, after, kCommon.turn)) return true;
        return tolerance_ > 0 && has_moved(t, before, after) &&
               is_off(to_vec3(after[t[0]]), to_vec3(after[t[1]]), to_vec3(after[t[2]]), face_of(t[0], t[1], t[2]));
    }
    /// Whether a triangle is farther from the surface than the tolerance; false on a face of the clip.
    [[nodiscard]] bool is_off(const Vec3& a, const Vec3& b, const Vec3& c, unsigned face) const {
        return face == 0 && levels_.local().is_farther(a, b, c, tolerance_);
    }

    /// Moves all chosen vertices by one step, except those whose triangles would turn by more than the angle of
    /// kCommon.turn or leave the surface.
    void move() {
        Positions next = mesh_.vertices;
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, vertices_.size(), 512), [&](const auto& range) {
            for (std::size_t n = range.begin(); n < range.end(); ++n) next[vertices_[n]] = moved(vertices_[n]);
        });
        const auto bad = [&](std::uint32_t t) { return is_invalid_move(mesh_.triangles[t], mesh_.vertices, next); };
        restore_all(table_, those(scope_, bad), mesh_.vertices, next, bad);
        mesh_.vertices.swap(next);
    }

    /// Moves vertices back to `before` and undoes flips until no triangles touch that did not touch before.
    void undo_contacts(const Positions& before, std::vector<Flip>& turned) {
        finder_.update();
        const bool all = 20 * scope_.size() > mesh_.triangles.size();  // checking all triangles is then faster
        std::vector<ContactFinder::Pair> contacts =
            all ? finder_.contacts(table_.is_closed()) : finder_.contacts_of(touched(turned));
        while (!contacts.empty()) {
            std::vector<std::uint32_t> moved, still;
            for (const auto& [s, t] : contacts) {
                const bool any_moved = has_moved(mesh_.triangles[s], before, mesh_.vertices) ||
                                       has_moved(mesh_.triangles[t], before, mesh_.vertices);
                for (const std::uint32_t n : {s, t}) (any_moved ? moved : still).push_back(n);
            }
            std::vector<std::uint32_t> changed = undo_flips(still, turned);
            moved.insert(moved.end(), changed.begin(), changed.end());
            const std::vector<std::uint32_t> more = restore_all(
                table_, moved, before, mesh_.vertices,
                [&](std::uint32_t t) { return is_invalid_move(mesh_.triangles[t], before, mesh_.vertices); });
            changed.insert(changed.end(), more.begin(), more.end());
            finder_.update();
            contacts = finder_.contacts_of(changed);
        }
    }
    /// The chosen triangles and those that flips have changed.
    [[nodiscard]] std::vector<std::uint32_t> touched(const std::vector<Flip>& turned) const {
        std::vector<std::uint32_t> all = scope_;
        for (const Flip& flip : turned) {
            all.push_back(flip.corner / 3);
            all.push_back(flip.across / 3);
        }
        std::sort(all.begin(), all.end());
        all.erase(std::unique(all.begin(), all.end()), all.end());
        return all;
    }

    /// Collapses the shortest side of each sliver. Moves of vertices alone cannot widen slivers on a part of the solid,
    /// such as a sharp edge, that is narrower than a triangle. @return the number of collapses
    std::size_t collapse_slivers() {
        finder_.update();
        std::deque<std::uint32_t> queue;
        for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
            if (is_sliver(t)) queue.push_back(t);
        std::size_t count = 0;
        for (; !queue.empty(); queue.pop_front()) {
            const std::uint32_t t = queue.front();
            if (!is_sliver(t)) continue;
            const std::uint32_t corner = shortest_side(t), a = table_.vertex(CornerTable::next(corner));
            if (!try_collapse(corner)) continue;
            ++count;
            table_.around(a, [&](std::uint32_t c) { queue.push_back(c / 3); });
        }
        return count;
    }

    [[nodiscard]] bool is_worse(std::uint32_t t, double cosine) const {
        if (table_.is_gone(t)) return false;
        const Triangle& v = mesh_.triangles[t];
        return worst_cosine(at(v[0]), at(v[1]), at(v[2])) > cosine;
    }
    [[nodiscard]] bool is_sliver(std::uint32_t t) const { return is_worse(t, kRelax.sliver); }

    /// The corner opposite to the shortest side.
    [[nodiscard]] std::uint32_t shortest_side(std::uint32_t t) const {
        std::uint32_t best = 3 * t;
        double minimum = std::numeric_limits<double>::max();
        for (std::uint32_t c = 3 * t; c < 3 * t + 3; ++c) {
            const double size =
                length(minus(at(table_.vertex(CornerTable::next(c))), at(table_.vertex(CornerTable::previous(c)))));
            if (size >= minimum) continue;
            minimum = size;
            best = c;
        }
        return best;
    }

    /// Positions at which an edge's ends can merge: halfway if they are held on the same surfaces (see Hold), and each
    /// end that is held on all surfaces of the other one.
    [[nodiscard]] std::vector<Position> meeting_points(std::uint32_t a, std::uint32_t b) const {
        const Level& level = levels_.local();
        const unsigned all = holds_[a] | holds_[b];
        const Position &pa = mesh_.vertices[a], &pb = mesh_.vertices[b];
        std::vector<Position> points;
        if ((all & kFixed) || length(minus(to_vec3(pa), to_vec3(pb))) > kCommon.precision_voxels * level.voxel_size())
            return points;
        Position goal;
        for (int k = 0; k < 3; ++k)
            goal[k] = holds_[a] >> k & 1 ? pa[k] : holds_[b] >> k & 1 ? pb[k] : 0.5F * (pa[k] + pb[k]);
        if ((all & kChamfer) || (holds_[a] == holds_[b] && !(all & kOnLevel)))
            points.push_back(goal);
        else if (holds_[a] == holds_[b]) {
            const auto found = level.project(to_vec3(goal), all & kFaces);
            if (found && length(minus(*found, to_vec3(goal))) < kRelax.off_level * level.voxel_size())
                points.push_back(to_position(*found));
            for (int k = 0; k < 3 && !points.empty(); ++k)
                if (all >> k & 1) points.back()[k] = goal[k];
        }
        if (!(all & kChamfer))
            for (const std::uint32_t v : {a, b})
                if (holds_[v] == all) points.push_back(mesh_.vertices[v]);
        return points;
    }

    bool try_collapse(std::uint32_t corner) {
        EdgeCollapser edge(table_, mesh_.vertices, finder_);
        if (!edge.select(corner)) return false;
        const std::uint32_t a = edge.kept(), b = edge.lost();
        for (const Position& there : meeting_points(a, b)) {
            // The collapse must reduce the number of slivers, and make no angle smaller than the smallest one before.
            int slivers = 0;
            double narrowest_before = 0, narrowest = 0;
            bool worse = false;
            const auto shape_of = [&](std::uint32_t t) {
                const Triangle& v = mesh_.triangles[t];
                const double shape = worst_cosine(at(v[0]), at(v[1]), at(v[2]));
                slivers += int(shape > kRelax.sliver);
                narrowest_before = std::max(narrowest_before, shape);
                return shape;
            };
            for (const std::uint32_t t : edge.going()) shape_of(t);
            for (const EdgeCollapser::Left& t : edge.left()) {
                const Vec3 next = at(t.next), previous = at(t.previous), p = to_vec3(there);
                const Vec3 was = area_normal(at(t.mover), next, previous), is = area_normal(p, next, previous);
                const double before = shape_of(t.number), after = worst_cosine(p, next, previous);
                slivers -= int(after > kRelax.sliver);
                narrowest = std::max(narrowest, after);
                worse = worse ||
                        (tolerance_ > 0 &&
                         is_off(p, next, previous, holds_[t.mover] & holds_[t.next] & holds_[t.previous] & kFaces));
                worse =
                    worse || !(dot(was, is) > (before > kRelax.sliver ? 0.0 : kCommon.turn) * length(was) * length(is));
            }
            if (worse || slivers <= 0 || narrowest > narrowest_before || !edge.collapse(there)) continue;
            holds_[a] |= holds_[b];
            return true;
        }
        return false;
    }

    TriangleMesh& mesh_;
    CornerTable table_;
    ContactFinder finder_;
    mutable tbb::enumerable_thread_specific<Level> levels_;
    std::vector<std::uint8_t> holds_;
    std::vector<std::uint32_t> vertices_, scope_;  // chosen vertices to be moved, and the triangles around them, sorted
    // [voxels] maximum distance of triangles from the surface; 0: no limit
    const double tolerance_;
    const RunContext& run_;
};

}  // namespace
}  // namespace meshing

RelaxReport relax_mesh(TriangleMesh& mesh, const FloatGrid& level_set, const RelaxOptions& options,
                       const RunContext& run) {
    require_valid(options, "relax_mesh");
    RelaxReport report;
    if (mesh.empty()) return report;
    with_threads(run, [&] {
        report.smallest_angle_before = smallest_angle(mesh);
        const meshing::Surface surface(level_set, options.isovalue, mesh.origin);
        meshing::Relaxer(mesh, surface, options.tolerance, run).relax(options.rounds, report);
        meshing::remove_gone(mesh.triangles, mesh.vertices);
        report.triangles = std::int64_t(mesh.triangles.size());
        report.smallest_angle = smallest_angle(mesh);
        report.deviation = surface.deviation(mesh);
    });
    return report;
}

MeshDeviation measure_deviation(const FloatGrid& level_set, const TriangleMesh& mesh, double isovalue,
                                const RunContext& run) {
    MeshDeviation deviation;
    with_threads(run, [&] { deviation = meshing::Surface(level_set, isovalue, mesh.origin).deviation(mesh); });
    return deviation;
}

}  // namespace covol
