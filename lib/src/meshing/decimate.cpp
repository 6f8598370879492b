#include "meshing/decimate.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "base/heuristics.h"
#include "covol/error.h"
#include "mesh/corner_table.h"
#include "meshing/contacts.h"
#include "meshing/heuristics.h"

namespace covol::meshing {
namespace {

/// If a collapse decreases the smallest angle of a triangle, and the cosine of this angle is then above `cosine`, the
/// cost of the collapse is multiplied by `factor`. The cosines in kNeedles are those of 23, 14 and 6 degrees.
struct Needle {
    double cosine;
    float factor;
};
constexpr Needle kNeedles[] = {{0.92, 10}, {0.97, 100}, {0.995, std::numeric_limits<float>::infinity()}};

struct Traits : OpenMesh::DefaultTraitsDouble {
    VertexAttributes(OpenMesh::Attributes::Status);
    EdgeAttributes(OpenMesh::Attributes::Status);
    HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge);
    FaceAttributes(OpenMesh::Attributes::Status);
};

/// The decimater calls is_collapse_ok() for each edge before it evaluates its priority, and again immediately before it
/// collapses the edge.
class HalfEdges : public OpenMesh::TriMesh_ArrayKernelT<Traits> {
public:
    std::function<bool(HalfedgeHandle)> is_chosen;
    bool is_collapse_ok(HalfedgeHandle edge) { return is_chosen(edge); }
    bool keeps_topology(HalfedgeHandle edge) { return OpenMesh::TriMesh_ArrayKernelT<Traits>::is_collapse_ok(edge); }
};

/// Builds OpenMesh's mesh. Its faces and vertices have the numbers of the triangles and vertices of `mesh`, and keep
/// them because OpenMesh's garbage collection, which would change them, is never called.
void build(HalfEdges& edges, const TriangleMesh& mesh) {
    // The coordinates are moved near 0, because quadrics subtract squares of coordinates from each other, and scaled so
    // that triangles have a size of about 1, because costs are fourth powers of lengths in single precision.
    const Vec3 middle = to_vec3(mesh.vertices[mesh.triangles.front()[0]]);
    double area = 0;
    for (const Triangle& t : mesh.triangles)
        area += length(area_normal(mesh.vertices, t)) / double(mesh.triangles.size());
    const double scale = area > 0 ? 1 / std::sqrt(area) : 1.0;
    edges.reserve(mesh.vertices.size(), 3 * mesh.triangles.size() / 2, mesh.triangles.size());
    for (const Position& v : mesh.vertices) {
        const Vec3 p = minus(to_vec3(v), middle);
        edges.add_vertex({scale * p[0], scale * p[1], scale * p[2]});
    }
    for (const Triangle& t : mesh.triangles) {
        const auto corner = [&](int k) { return HalfEdges::VertexHandle(int(t[std::size_t(k)])); };
        if (!edges.add_face(corner(0), corner(1), corner(2)).is_valid())
            throw Error(Errc::InvalidInput, "expected a manifold mesh; repair it first");
    }
}

/// Decides on collapses: OpenMesh's quadrics, shorter edges first if the cost is equal, and no collapse after which a
/// vertex would leave a face of a clip or a triangle would turn, be a needle, leave the level set or touch another.
class SafeQuadric : public OpenMesh::Decimater::ModQuadricT<HalfEdges> {
public:
    using Quadric = OpenMesh::Decimater::ModQuadricT<HalfEdges>;
    using Handle = OpenMesh::Decimater::ModHandleT<SafeQuadric>;
    using CollapseInfo = Quadric::CollapseInfo;
    explicit SafeQuadric(HalfEdges& mesh) : Quadric(mesh) {}
    DECIMATER_MODNAME(SafeQuadric)

    /// @param trust  whether to assume, without a test, that changed triangles touch no other ones if finder_ has found
    /// a single sheet around them and they face in its direction.
    void begin(TriangleMesh& mesh, const CornerTable& table, const Surface* surface, const DecimateGoal& goal,
               bool trust, const RunContext& run) {
        mesh_ = &mesh;
        goal_ = goal;
        run_ = &run;
        if (surface != nullptr) {
            level_.emplace(surface->level());
            holds_ = holds_of(table, mesh.vertices, *level_);
        } else {
            holds_.assign(mesh.vertices.size(), kOnLevel);
            for (std::uint32_t v = 0; v < holds_.size(); ++v)
                if (table.corner_of(v) == CornerTable::kNone || table.is_boundary(v)) holds_[v] |= kFixed;
        }
        finder_.emplace(mesh.vertices, mesh.triangles);
        trust_ = trust && table.is_closed();
        if (trust_) finder_->find_single_sheets();
        left_ = refreshed_ = mesh.triangles.size();
        cost_.assign(mesh.vertices.size(), 0);
        check_contacts_.assign(mesh.vertices.size(), 0);
        this->mesh().is_chosen = [this](HalfEdges::HalfedgeHandle edge) { return is_chosen(edge); };
    }

    /// Call before each decimate() of OpenMesh's decimater, which queries the edges of all vertices anew.
    void begin_pass() {
        chosen_.assign(mesh_->vertices.size(), HalfEdges::HalfedgeHandle());
        requested_ = kNoVertex;
    }
    [[nodiscard]] std::size_t left() const { return left_; }

    /// Checks the whole mesh for contacts if tests were omitted in single sheets (trust_). @return whether no triangles
    /// touch
    [[nodiscard]] bool is_free() {
        if (!trust_) return true;
        finder_->rebuild();
        return finder_->contacts(true).empty();
    }

    /// The cost of the collapse that choose() has chosen for the vertex edge.v0.
    float collapse_priority(const CollapseInfo& edge) override { return cost_[number(edge.v0)]; }

    void preprocess_collapse(const CollapseInfo& edge) override {
        gather(edge.v0v1);
        // The collapse changes triangles around the neighbours, whose own collapses therefore have to be chosen again.
        for (const auto v : mesh().vv_range(edge.v0)) chosen_[number(v)].invalidate();
    }

    void postprocess_collapse(const CollapseInfo& edge) override {
        Quadric::postprocess_collapse(edge);
        for (const std::uint32_t t : gone_) mesh_->triangles[t].fill(CornerTable::kNone);
        for (const ContactFinder::Change& change : changed_) {
            mesh_->triangles[change.number] = change.corners;
            finder_->grow(change.number);
        }
        requested_ = kNoVertex;
        left_ -= gone_.size();
        if (left_ >= refreshed_ / 2) return;
        finder_->rebuild();  // because grow() only enlarges boxes
        if (trust_) finder_->find_single_sheets();
        refreshed_ = left_;
        const auto all = double(mesh_->triangles.size());
        run_->report("decimate", (all - double(left_)) / std::max(1.0, all - double(goal_.triangles)));
        run_->check();
    }

private:
    static constexpr std::uint32_t kNoVertex = CornerTable::kNone;
    template <typename Handle>
    static std::uint32_t number(Handle handle) {
        return std::uint32_t(handle.idx());
    }

    /// Whether an edge may be collapsed. The decimater queries all edges that leave a vertex in sequence, to queue the
    /// cheapest one, and queries that one again immediately before the collapse.
    bool is_chosen(HalfEdges::HalfedgeHandle edge) {
        const auto lost = mesh().from_vertex_handle(edge);
        const bool again = requested_ == number(lost);
        if (chosen_[number(lost)] == edge && (!again || queued_)) return is_free_still(edge);
        if (!again) {
            requested_ = number(lost);
            choose(lost);
            queued_ = false;
        }
        queued_ = queued_ || chosen_[requested_] == edge;
        return chosen_[requested_] == edge;
    }

    void choose(HalfEdges::VertexHandle vertex) {
        const std::uint32_t lost = number(vertex);
        chosen_[lost].invalidate();
        if (holds_[lost] & (kFixed | kChamfer)) return;
        candidates_.clear();
        for (const auto edge : mesh().voh_range(vertex)) {
            const CollapseInfo info(mesh(), edge);
            const std::uint8_t kept = holds_[number(info.v1)];
            if ((kept & (kFixed | kChamfer)) || (holds_[lost] & ~kept)) continue;
            const double square = (info.p1 - info.p0).sqrnorm();
            candidates_.emplace_back(
                std::max(0.0F, Quadric::collapse_priority(info)) + float(kDecimate.roundness * square * square), edge);
        }
        for (auto& [cost, edge] : candidates_) {
            gather(edge);
            cost *= shape_factor(lost);
        }
        std::sort(candidates_.begin(), candidates_.end());
        for (const auto& [cost, edge] : candidates_) {
            if (!std::isfinite(cost)) return;
            gather(edge);
            if (!mesh().keeps_topology(edge) || leaves_surface(lost) || (check_contacts_[lost] && touches(edge)))
                continue;
            chosen_[lost] = edge;
            cost_[lost] = cost;
            return;
        }
    }

    /// Checks the chosen collapse again immediately before it is made, because the mesh around the neighbours may have
    /// changed since. If triangles would touch, choose() will from now on also check contacts for this vertex, which is
    /// not necessary for most vertices.
    bool is_free_still(HalfEdges::HalfedgeHandle edge) {
        if (!mesh().keeps_topology(edge)) return false;
        gather(edge);
        const bool touching = touches(edge);
        if (touching) check_contacts_[number(mesh().from_vertex_handle(edge))] = 1;
        return !touching;
    }

    /// Collects the triangles around the removed vertex as they are after the collapse; their first corner is the
    /// vertex that replaces it.
    void gather(HalfEdges::HalfedgeHandle edge) {
        const HalfEdges& edges = mesh();
        const auto lost = edges.from_vertex_handle(edge), kept = edges.to_vertex_handle(edge);
        gone_ = {number(edges.face_handle(edge)), number(edges.opposite_face_handle(edge))};
        changed_.clear();
        for (const auto side : edges.voh_range(lost)) {
            const std::uint32_t t = number(edges.face_handle(side));
            if (t == gone_[0] || t == gone_[1]) continue;
            changed_.push_back({t,
                                {number(kept), number(edges.to_vertex_handle(side)),
                                 number(edges.to_vertex_handle(edges.next_halfedge_handle(side)))}});
        }
    }

    [[nodiscard]] Vec3 at(std::uint32_t v) const { return to_vec3(mesh_->vertices[v]); }

    /// The factor by which the shapes of the changed triangles increase the cost of the collapse. It is infinite if one
    /// of them turns by more than the angle of kCommon.turn or becomes too thin: see kNeedles.
    [[nodiscard]] float shape_factor(std::uint32_t lost) const {
        const Vec3 from = at(lost);
        double worst = -1;
        for (const auto& [triangle, t] : changed_) {
            const Vec3 to = at(t[0]), next = at(t[1]), previous = at(t[2]);
            const Vec3 was = area_normal(from, next, previous), is = area_normal(to, next, previous);
            if (!(dot(was, is) > kCommon.turn * length(was) * length(is)))
                return std::numeric_limits<float>::infinity();
            const double now = worst_cosine(to, next, previous);
            if (now > worst && now > kNeedles[0].cosine && now > worst_cosine(from, next, previous)) worst = now;
        }
        float factor = 1;
        for (const Needle& needle : kNeedles)
            if (worst > needle.cosine) factor = needle.factor;
        // With a tolerance, needles are not accepted: good shapes are preferred to few triangles.
        return goal_.tolerance > 0 && factor > 1 ? std::numeric_limits<float>::infinity() : factor;
    }

    [[nodiscard]] bool leaves_surface(std::uint32_t lost) {
        return goal_.tolerance > 0 &&
               std::any_of(changed_.begin(), changed_.end(), [&](const ContactFinder::Change& change) {
                   const Triangle& t = change.corners;
                   return !(holds_[lost] & holds_[t[1]] & holds_[t[2]] & kFaces) &&
                          level_->is_farther(at(t[0]), at(t[1]), at(t[2]), goal_.tolerance);
               });
    }

    [[nodiscard]] bool touches(HalfEdges::HalfedgeHandle edge) {
        const Position& there = mesh_->vertices[number(mesh().to_vertex_handle(edge))];
        return !(trust_ && finder_->face_along_sheet(changed_, there)) && finder_->would_touch(changed_, gone_);
    }

    TriangleMesh* mesh_ = nullptr;
    DecimateGoal goal_;
    const RunContext* run_ = nullptr;
    std::optional<ContactFinder> finder_;
    std::optional<Level> level_;
    std::vector<std::uint8_t> holds_;
    bool trust_ = false;
    std::size_t left_ = 0, refreshed_ = 0;           // number of triangles: now, and at the last rebuild of finder_
    std::uint32_t requested_ = kNoVertex;            // the vertex whose edges the decimater queries
    bool queued_ = false;                            // whether the edge chosen for requested_ was queried
    std::vector<HalfEdges::HalfedgeHandle> chosen_;  // by vertex: edge to collapse; invalid: none, or not chosen yet
    std::vector<float> cost_;                        // by vertex: cost of the chosen collapse
    std::vector<std::pair<float, HalfEdges::HalfedgeHandle>> candidates_;
    // By vertex: whether a chosen collapse was refused because triangles would touch; see is_free_still().
    std::vector<std::uint8_t> check_contacts_;
    std::vector<ContactFinder::Change> changed_;  // triangles that the collapse under examination changes
    std::array<std::uint32_t, 2> gone_{};
};

/// @return whether no triangles touch afterwards
bool decimate(TriangleMesh& mesh, const Surface* surface, const DecimateGoal& goal, bool trust, const RunContext& run) {
    // Throws if the mesh is not manifold, for which OpenMesh would only print a message.
    const CornerTable table(mesh.triangles, mesh.vertices.size());
    HalfEdges edges;
    build(edges, mesh);
    OpenMesh::Decimater::DecimaterT<HalfEdges> decimater(edges);
    SafeQuadric::Handle handle;
    decimater.add(handle);
    SafeQuadric& decider = decimater.module(handle);
    decider.begin(mesh, table, surface, goal, trust, run);
    decimater.initialize();
    for (int pass = 0; pass < kCommon.rounds && decider.left() > goal.triangles; ++pass) {
        decider.begin_pass();
        // A collapse removes two triangles.
        if (decimater.decimate((decider.left() - goal.triangles + 1) / 2) == 0) break;
    }
    return decider.is_free();
}

}  // namespace

void decimate(TriangleMesh& mesh, const Surface* surface, const DecimateGoal& goal, const RunContext& run) {
    if (mesh.triangles.size() <= goal.triangles) return;
    TriangleMesh work = mesh;
    if (decimate(work, surface, goal, true, run))
        mesh = std::move(work);
    else  // triangles touch in a sheet that was trusted: starts again, with a contact check before each collapse
        decimate(mesh, surface, goal, false, run);
    remove_gone(mesh.triangles, mesh.vertices);
}

}  // namespace covol::meshing
