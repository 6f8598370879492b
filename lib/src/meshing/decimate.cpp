#include "meshing/decimate.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "meshing/contacts.h"
#include "meshing/corner_table.h"
#include "meshing/edge_collapser.h"

namespace covol::meshing {
namespace {

constexpr double kRoundness = 1e-3;  // weight of the distance from an edge's middle against that from the planes
constexpr double kTurn = 0.5;        // cosine: a triangle may not turn farther
/// Cosines of angles, 23, 14 and 6 degrees: no triangle with a smaller one, but where one was; the next once nothing else is left.
constexpr double kNeedles[] = {0.92, 0.97, 0.995};
constexpr double kNearMiddle = 1.0;  // lengths of the edge: the point of least error is no good farther from its middle

/// The sum of squared distances to planes, weighted: x A x - 2 b x + c.
struct Quadric {
    double a[6]{}, b[3]{}, c = 0;  ///< A: xx, xy, xz, yy, yz, zz

    void add_plane(const Vec3& n, double offset, double weight) {
        const double products[6] = {n[0] * n[0], n[0] * n[1], n[0] * n[2], n[1] * n[1], n[1] * n[2], n[2] * n[2]};
        for (int k = 0; k < 6; ++k) a[k] += weight * products[k];
        for (int k = 0; k < 3; ++k) b[k] += weight * offset * n[k];
        c += weight * offset * offset;
    }
    void add_point(const Vec3& p, double weight) {
        for (const int k : {0, 3, 5}) a[k] += weight;
        for (int k = 0; k < 3; ++k) b[k] += weight * p[k];
        c += weight * dot(p, p);
    }
    void add(const Quadric& other) {
        for (int k = 0; k < 6; ++k) a[k] += other.a[k];
        for (int k = 0; k < 3; ++k) b[k] += other.b[k];
        c += other.c;
    }
    /// Twice the areas that it weighs.
    [[nodiscard]] double trace() const { return a[0] + a[3] + a[5]; }
    [[nodiscard]] double at(const Vec3& p) const {
        const Vec3 ap{a[0] * p[0] + a[1] * p[1] + a[2] * p[2], a[1] * p[0] + a[3] * p[1] + a[4] * p[2], a[2] * p[0] + a[4] * p[1] + a[5] * p[2]};
        return dot(ap, p) - 2 * (b[0] * p[0] + b[1] * p[1] + b[2] * p[2]) + c;
    }
    /// Of the coordinates that are not held.
    [[nodiscard]] std::optional<Vec3> minimum(const Vec3& start, unsigned held) const {
        double m[3][4] = {{a[0], a[1], a[2], b[0]}, {a[1], a[3], a[4], b[1]}, {a[2], a[4], a[5], b[2]}};
        for (int k = 0; k < 3; ++k)
            if (held >> k & 1) {
                for (double& x : m[k]) x = 0;
                m[k][k] = 1;
                m[k][3] = start[k];
            }
        for (int i = 0; i < 3; ++i) {
            int pivot = i;
            for (int r = i + 1; r < 3; ++r)
                if (std::abs(m[r][i]) > std::abs(m[pivot][i])) pivot = r;
            std::swap(m[i], m[pivot]);
            if (!(std::abs(m[i][i]) > 1e-12 * trace())) return {};
            for (int r = i + 1; r < 3; ++r) {
                const double f = m[r][i] / m[i][i];
                for (int k = i; k < 4; ++k) m[r][k] -= f * m[i][k];
            }
        }
        Vec3 x;
        for (int i = 2; i >= 0; --i) {
            double sum = m[i][3];
            for (int k = i + 1; k < 3; ++k) sum -= m[i][k] * x[k];
            x[i] = sum / m[i][i];
        }
        return x;
    }
};

struct Edge {
    float cost;  ///< >= 0
    std::uint32_t a, b, stamp;
};

/// Edges by their cost, to three percent: by a float's exponent and the first bits after it. Those alike come as they went in.
class CheapestFirst {
public:
    CheapestFirst() : buckets_(std::size_t(1) << (31 - kDropped)), taken_(buckets_.size(), 0), lowest_(buckets_.size()) {}
    void push(const Edge& edge) {
        const std::size_t bucket = std::bit_cast<std::uint32_t>(edge.cost) >> kDropped;
        buckets_[bucket].push_back(edge);
        lowest_ = std::min(lowest_, bucket);
    }
    [[nodiscard]] std::optional<Edge> pop() {
        for (; lowest_ < buckets_.size(); ++lowest_) {
            if (taken_[lowest_] < buckets_[lowest_].size()) return buckets_[lowest_][taken_[lowest_]++];
            buckets_[lowest_].clear();
            taken_[lowest_] = 0;
        }
        return {};
    }

private:
    static constexpr int kDropped = 18;
    std::vector<std::vector<Edge>> buckets_;
    std::vector<std::size_t> taken_;
    std::size_t lowest_;
};

class Decimater {
public:
    Decimater(TriangleMesh& mesh, const Surface* surface, const DecimateGoal& goal)
        : mesh_(mesh), table_(mesh.triangles, mesh.vertices.size()), finder_(mesh.vertices, mesh.triangles),
          edge_(table_, mesh.vertices, finder_), goal_(goal), stamps_(mesh.vertices.size(), 0) {
        if (surface != nullptr) {
            level_.emplace(surface->level());
            holds_ = holds_of(table_, mesh.vertices, *level_);
        } else {
            holds_.assign(mesh.vertices.size(), kOnLevel);
            for (std::uint32_t v = 0; v < holds_.size(); ++v)
                if (table_.corner_of(v) == CornerTable::kNone || table_.is_boundary(v)) holds_[v] |= kFixed;
        }
    }

    /// @param trust  see EdgeCollapser::collapse(). @return whether no triangles touch afterwards, known where `trust`
    bool run(bool trust, const RunContext& run) {
        trust = trust && table_.is_closed();
        if (trust) finder_.find_single_sheets();
        gather_quadrics();
        left_ = refreshed_ = mesh_.triangles.size();
        for (const double needle : kNeedles) {
            needle_ = needle;
            // With a tolerance the goal is good triangles, not few.
            if (left_ <= goal_.triangles || (goal_.tolerance > 0 && needle != kNeedles[0])) break;
            fill_queue();
            collapse_in_order(trust, run);
        }
        if (!trust) return true;
        finder_.rebuild();
        return finder_.contacts(true).empty();
    }

private:
    void collapse_in_order(bool trust, const RunContext& run) {
        const auto all = double(mesh_.triangles.size());
        while (left_ > goal_.triangles) {
            const std::optional<Edge> next = queue_.pop();
            if (!next) return;
            const Edge& entry = *next;
            if (entry.stamp != stamps_[entry.a] + stamps_[entry.b]) continue;  // an end has moved since
            const std::uint32_t corner = corner_facing(entry.a, entry.b);
            if (corner == CornerTable::kNone || !collapse(corner, trust)) continue;
            left_ -= 2;
            if (left_ >= refreshed_ / 2) continue;
            finder_.rebuild();  // boxes only grow
            if (trust) finder_.find_single_sheets();
            refreshed_ = left_;
            run.report("decimate", (all - double(left_)) / std::max(1.0, all - double(goal_.triangles)));
            run.check();
        }
    }

    [[nodiscard]] Vec3 at(std::uint32_t v) const { return minus(to_vec3(mesh_.vertices[v]), middle_); }

    void gather_quadrics() {
        middle_ = to_vec3(mesh_.vertices[mesh_.triangles.front()[0]]);
        quadrics_.resize(mesh_.vertices.size());
        tbb::parallel_for(std::uint32_t(0), std::uint32_t(quadrics_.size()), [&](std::uint32_t v) {
            table_.around(v, [&](std::uint32_t c) {
                const Triangle& t = mesh_.triangles[c / 3];
                const Vec3 n = area_normal(at(t[0]), at(t[1]), at(t[2]));
                const double size = length(n);
                if (!(size > 0)) return;
                const Vec3 unit{n[0] / size, n[1] / size, n[2] / size};
                quadrics_[v].add_plane(unit, dot(unit, at(v)), size);
            });
        });
    }

    /// What an edge's ends have in common can move, and where to. None where they cannot meet.
    struct Meeting {
        Vec3 there;
        double cost;
    };
    [[nodiscard]] std::optional<Meeting> meeting(std::uint32_t a, std::uint32_t b) const {
        const unsigned all = holds_[a] | holds_[b];
        if (all & (kFixed | kChamfer)) return {};
        Quadric q = quadrics_[a];
        q.add(quadrics_[b]);
        const Vec3 pa = at(a), pb = at(b), half = plus(pa, 0.5, minus(pb, pa));
        const double edge = length(minus(pb, pa));
        q.add_point(half, kRoundness * q.trace());
        if (holds_[a] != holds_[b]) {
            if (holds_[a] != all && holds_[b] != all) return {};
            const Vec3 end = holds_[a] == all ? pa : pb;
            return Meeting{end, q.at(end)};
        }
        Vec3 best = half;
        if (const auto found = q.minimum(pa, all & kFaces); found && length(minus(*found, half)) < kNearMiddle * edge) best = *found;
        for (int k = 0; k < 3; ++k)
            if (all >> k & 1) best[k] = pa[k];
        return Meeting{best, q.at(best)};
    }

    [[nodiscard]] std::optional<Edge> edge_of(std::uint32_t a, std::uint32_t b) const {
        const auto found = meeting(a, b);
        if (!found) return {};
        return Edge{float(std::max(0.0, found->cost)), a, b, stamps_[a] + stamps_[b]};
    }

    void fill_queue() {
        std::vector<std::optional<Edge>> edges(3 * mesh_.triangles.size());
        tbb::parallel_for(std::uint32_t(0), std::uint32_t(edges.size()), [&](std::uint32_t c) {
            if (!table_.is_gone(c / 3) && table_.opposite(c) != CornerTable::kNone && c < table_.opposite(c))
                edges[c] = edge_of(table_.vertex(CornerTable::next(c)), table_.vertex(CornerTable::previous(c)));
        });
        for (const auto& edge : edges)
            if (edge) queue_.push(*edge);
    }

    [[nodiscard]] std::uint32_t corner_facing(std::uint32_t a, std::uint32_t b) const {
        std::uint32_t found = CornerTable::kNone;
        table_.around(a, [&](std::uint32_t c) {
            if (table_.vertex(CornerTable::next(c)) == b) found = CornerTable::previous(c);
        });
        return found;
    }

    bool collapse(std::uint32_t corner, bool trust) {
        if (!edge_.look(corner)) return false;
        const std::uint32_t a = edge_.kept(), b = edge_.lost();
        const auto found = meeting(a, b);
        if (!found) return false;
        Position there = to_position(plus(found->there, 1, middle_));
        for (int k = 0; k < 3; ++k)
            if ((holds_[a] | holds_[b]) >> k & 1) there[k] = mesh_.vertices[holds_[a] >> k & 1 ? a : b][k];
        if (spoils(there) || !edge_.collapse(there, trust)) return false;
        quadrics_[a].add(quadrics_[b]);
        holds_[a] |= holds_[b];
        ++stamps_[a];
        ++stamps_[b];
        table_.around(a, [&](std::uint32_t c) {
            if (const auto edge = edge_of(a, table_.vertex(CornerTable::next(c)))) queue_.push(*edge);
        });
        return true;
    }

    /// Whether the collapse that is looked at would turn a triangle, make a needle of it, or move it off the surface.
    [[nodiscard]] bool spoils(const Position& there) const {
        const Vec3 p = to_vec3(there);
        for (const EdgeCollapser::Left& t : edge_.left()) {
            const Vec3 next = to_vec3(mesh_.vertices[t.next]), previous = to_vec3(mesh_.vertices[t.previous]), mover = to_vec3(mesh_.vertices[t.mover]);
            const Vec3 was = area_normal(mover, next, previous), is = area_normal(p, next, previous);
            if (!(dot(was, is) > kTurn * length(was) * length(is))) return true;
            const double worst = worst_cosine(p, next, previous);
            if (worst > needle_ && worst > worst_cosine(mover, next, previous)) return true;
        }
        if (!(goal_.tolerance > 0)) return false;
        for (const EdgeCollapser::Left& t : edge_.left()) {
            if (holds_[t.mover] & holds_[t.next] & holds_[t.previous] & kFaces) continue;
            if (level_->is_farther(p, to_vec3(mesh_.vertices[t.next]), to_vec3(mesh_.vertices[t.previous]), goal_.tolerance)) return true;
        }
        return false;
    }

    TriangleMesh& mesh_;
    CornerTable table_;
    ContactFinder finder_;
    EdgeCollapser edge_;
    const DecimateGoal goal_;
    std::optional<Level> level_;
    Vec3 middle_{};  // near the mesh: quadrics are differences of squares
    std::vector<Quadric> quadrics_;
    std::vector<std::uint8_t> holds_;
    std::vector<std::uint32_t> stamps_;
    CheapestFirst queue_;
    std::size_t left_ = 0, refreshed_ = 0;  // triangles: now, and when the finder was put in order
    double needle_ = 1;
};

}  // namespace

void decimate(TriangleMesh& mesh, const Surface* surface, const DecimateGoal& goal, const RunContext& run) {
    if (mesh.triangles.size() <= goal.triangles) return;
    TriangleMesh work = mesh;
    if (Decimater(work, surface, goal).run(true, run)) mesh = std::move(work);
    else Decimater(mesh, surface, goal).run(false, run);  // each collapse is checked
    remove_gone(mesh.triangles, mesh.vertices);
}

}  // namespace covol::meshing
