#include "covol/holes.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "base/disjoint_sets.h"
#include "covol/error.h"
#include "covol/points.h"
#include "holes/cut.h"
#include "holes/heuristics.h"
#include "holes/membrane.h"
#include "mesh/triangle.h"
#include "points/kd_tree.h"

namespace covol {
namespace {

// 95th percentile of the nearest-neighbour distance of uniformly random points on a surface, times sqrt(density)
constexpr double kP95OfSpacing = 0.976;

using Triangle = std::array<std::uint32_t, 3>;

double area_of(const TriangleMesh& mesh, const Triangle& t) {
    return meshing::area(mesh.place(t[0]), mesh.place(t[1]), mesh.place(t[2]));
}

/// Step of the diffusion in smooth(), as a fraction of the way from a vertex's value to the mean of its neighbours.
/// With at most 0.5, a component of the values that alternates between neighbours is damped without changing its sign.
/// The value hardly changes the result, because the number of steps is computed from it.
constexpr float kStep = 0.5F;

/// Diffusion over the mesh: approximately a Gaussian of standard deviation `width` if the triangles are even.
void smooth(const TriangleMesh& mesh, double width, std::vector<float>& values) {
    std::vector<std::uint32_t> count(values.size(), 0);
    double squares = 0;
    for (const Triangle& t : mesh.triangles)
        for (int k = 0; k < 3; ++k) {
            count[t[k]] += 2;
            squares += detail::squared_distance(mesh.place(t[k]), mesh.place(t[(k + 1) % 3]));
        }
    // The variance, along each axis, of the Gaussian to which one step corresponds: half the mean squared edge, times
    // kStep.
    const double variance = 0.5 * kStep * squares / double(3 * mesh.triangles.size());
    const auto steps = int(std::ceil(width * width / variance));
    std::vector<float> sums(values.size());
    for (int n = 0; n < steps; ++n) {
        std::fill(sums.begin(), sums.end(), 0.0F);
        for (const Triangle& t : mesh.triangles)
            for (int k = 0; k < 3; ++k) sums[t[k]] += values[t[(k + 1) % 3]] + values[t[(k + 2) % 3]];
        for (std::size_t v = 0; v < values.size(); ++v)
            if (count[v] > 0) values[v] += kStep * (sums[v] / float(count[v]) - values[v]);
    }
}

/// The sets of vertices that are connected by kept triangles, or by removed ones if `kept` is false.
detail::DisjointSets parts_of(const holes::CutMesh& cut, bool kept) {
    detail::DisjointSets parts(cut.mesh.vertices.size());
    for (std::size_t t = 0; t < cut.kept.size(); ++t) {
        if ((cut.kept[t] != 0) != kept) continue;
        const Triangle& c = cut.mesh.triangles[t];
        for (const std::uint32_t v : {c[1], c[2]}) parts.unite(v, c[0]);
    }
    return parts;
}

/// Divides a mesh into holes, which are removed, and a kept part: a triangle is kept if no ball of radius `distance` -
/// `slack` around a bare position, which is at least `distance` from all points, reaches it, and if it is not in a
/// small piece.
class HoleFinder {
public:
    HoleFinder(const TriangleMesh& mesh, const std::vector<float>& to_points, double distance, double slack)
        : mesh_(mesh), to_points_(to_points), distance_(distance), reach_(distance - slack) {}

    holes::CutMesh find(HolesReport& report, const RunContext& run) const {
        const std::vector<Vec3> bare = bare_places();
        run.check();
        holes::CutMesh cut = holes::cut_along(mesh_, from(bare));
        report.dropped_pieces = drop_small(cut);
        double area = 0, gone = 0;
        for (std::size_t t = 0; t < cut.kept.size(); ++t) {
            const double own = area_of(cut.mesh, cut.mesh.triangles[t]);
            area += own;
            if (!cut.kept[t]) gone += own;
        }
        report.distance = distance_;
        report.fraction = area > 0 ? gone / area : 0;
        report.loops = find_boundary_loops(holes::kept_part(cut));
        return cut;
    }

private:
    /// The bare positions: vertices farther than the distance from all points, and positions on edges at which the
    /// interpolated distance to the points is this distance.
    [[nodiscard]] std::vector<Vec3> bare_places() const {
        const auto far = float(distance_);
        std::vector<Vec3> places;
        for (std::uint32_t v = 0; v < to_points_.size(); ++v)
            if (to_points_[v] > far) places.push_back(mesh_.place(v));
        for (const Triangle& t : mesh_.triangles)
            for (int k = 0; k < 3; ++k) {
                const std::uint32_t a = t[k], b = t[(k + 1) % 3];
                if (!(to_points_[a] > far) || to_points_[b] > far) continue;
                const double fraction = double(to_points_[a] - far) / double(to_points_[a] - to_points_[b]);
                const Vec3 p = mesh_.place(a), q = mesh_.place(b);
                places.push_back({p[0] + fraction * (q[0] - p[0]), p[1] + fraction * (q[1] - p[1]),
                                  p[2] + fraction * (q[2] - p[2])});
            }
        return places;
    }

    /// For each vertex the distance to the nearest bare position minus reach_, at most reach_, and smoothed: positive
    /// on the kept part.
    [[nodiscard]] std::vector<float> from(const std::vector<Vec3>& bare) const {
        std::vector<float> values(to_points_.size(), float(reach_));
        if (bare.empty()) return values;
        const detail::KdTree tree(bare);
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, values.size(), 1024), [&](const auto& range) {
            for (std::size_t v = range.begin(); v != range.end(); ++v)
                values[v] =
                    float(std::min(std::sqrt(tree.nearest(mesh_.place(std::uint32_t(v)))), 2 * reach_) - reach_);
        });
        smooth(mesh_, kHoles.smoothing * distance_, values);
        return values;
    }

    /// Removes kept pieces that border a hole and whose area is less than that of a disc of radius distance_.
    /// @return number of pieces removed
    std::size_t drop_small(holes::CutMesh& cut) const {
        detail::DisjointSets parts = parts_of(cut, true);
        std::vector<char> ends(cut.mesh.vertices.size(), 0);
        for (std::size_t t = 0; t < cut.kept.size(); ++t)
            if (!cut.kept[t])
                for (const std::uint32_t v : cut.mesh.triangles[t]) ends[v] = 1;
        std::vector<double> area(cut.mesh.vertices.size(), 0);
        std::vector<char> is_cut(cut.mesh.vertices.size(), 0);
        for (std::size_t t = 0; t < cut.kept.size(); ++t) {
            if (!cut.kept[t]) continue;
            const std::uint32_t root = parts.root(cut.mesh.triangles[t][0]);
            area[root] += area_of(cut.mesh, cut.mesh.triangles[t]);
            for (const std::uint32_t v : cut.mesh.triangles[t]) is_cut[root] = is_cut[root] || ends[v];
        }
        const double minimum = M_PI * distance_ * distance_;
        for (std::size_t t = 0; t < cut.kept.size(); ++t) {
            const std::uint32_t root = parts.root(cut.mesh.triangles[t][0]);
            if (cut.kept[t] && is_cut[root] && area[root] < minimum) cut.kept[t] = 0;
        }
        std::size_t dropped = 0;
        for (std::size_t v = 0; v < area.size(); ++v) dropped += is_cut[v] && area[v] < minimum;
        return dropped;
    }

    const TriangleMesh& mesh_;
    const std::vector<float>& to_points_;
    double distance_, reach_;
};

void check(const TriangleMesh& mesh, const std::vector<float>& to_points, double distance, double slack) {
    if (to_points.size() != mesh.vertices.size())
        throw Error(Errc::InvalidInput, "expected the distance to the points for each of " +
                                            std::to_string(mesh.vertices.size()) + " vertices, got " +
                                            std::to_string(to_points.size()));
    if (!(distance > 0) || !(slack >= 0) || !(slack < distance))
        throw Error(Errc::InvalidOptions, "expected 0 <= slack < distance, got " + std::to_string(slack) + " and " +
                                              std::to_string(distance));
}

holes::CutMesh cut_holes(const TriangleMesh& mesh, const std::vector<float>& to_points, double distance, double slack,
                         HolesReport& report, const RunContext& run) {
    check(mesh, to_points, distance, slack);
    holes::CutMesh cut;
    with_threads(run, [&] { cut = HoleFinder(mesh, to_points, distance, slack).find(report, run); });
    if (std::find(cut.kept.begin(), cut.kept.end(), 1) == cut.kept.end())
        throw Error(Errc::InvalidInput,
                    "no part of the surface lies within " + std::to_string(distance) +
                        " of the points, so all of it would be a hole; use a larger `hole_distance`");
    return cut;
}

}  // namespace

double choose_hole_distance(const std::vector<Vec3>& points, double voxel_size) {
    return kHoles.far * std::max(voxel_size, measure_spacing(points).p95 / kP95OfSpacing);
}

std::vector<float> measure_distances(const TriangleMesh& mesh, const std::vector<Vec3>& points, const RunContext& run) {
    std::vector<float> result(mesh.vertices.size());
    with_threads(run, [&] {
        const detail::KdTree tree(points);
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, result.size(), 1024), [&](const auto& range) {
            for (std::size_t v = range.begin(); v != range.end(); ++v)
                result[v] = float(std::sqrt(tree.nearest(mesh.place(v))));
        });
    });
    return result;
}

double measure_fraction_beyond(const TriangleMesh& mesh, const std::vector<float>& distances, double distance) {
    double area = 0, beyond = 0;
    for (const Triangle& t : mesh.triangles) {
        const double own = area_of(mesh, t);
        area += own;
        if ((double(distances[t[0]]) + distances[t[1]] + distances[t[2]]) / 3 > distance) beyond += own;
    }
    return area > 0 ? beyond / area : 0;
}

std::vector<BoundaryLoop> find_boundary_loops(const TriangleMesh& mesh) {
    // A side of a triangle is on the boundary if no other triangle has it in the opposite direction.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> sides;
    for (const Triangle& t : mesh.triangles)
        for (int k = 0; k < 3; ++k) sides.emplace_back(t[k], t[(k + 1) % 3]);
    std::sort(sides.begin(), sides.end());
    constexpr std::uint32_t kNone = ~std::uint32_t(0);
    std::vector<std::uint32_t> next(mesh.vertices.size(), kNone);
    for (const auto& [a, b] : sides)
        if (!std::binary_search(sides.begin(), sides.end(), std::pair{b, a})) next[a] = b;
    std::vector<BoundaryLoop> loops;
    for (std::uint32_t first = 0; first < next.size(); ++first) {
        if (next[first] == kNone) continue;
        BoundaryLoop loop;
        for (std::uint32_t v = first; next[v] != kNone;) {
            const std::uint32_t to = std::exchange(next[v], kNone);
            const Vec3 a = mesh.place(v), b = mesh.place(to);
            loop.length += std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
            ++loop.edges;
            v = to;
        }
        loops.push_back(loop);
    }
    std::sort(loops.begin(), loops.end(),
              [](const BoundaryLoop& a, const BoundaryLoop& b) { return a.length > b.length; });
    return loops;
}

TreatedHoles trim_holes(const TriangleMesh& mesh, const std::vector<float>& to_points, double distance, double slack,
                        const RunContext& run) {
    HolesReport report;
    const holes::CutMesh cut = cut_holes(mesh, to_points, distance, slack, report, run);
    report.policy = Holes::Open;
    return {report.fraction > 0 ? holes::kept_part(cut) : mesh, std::move(report)};
}

TreatedHoles flatten_holes(const TriangleMesh& mesh, const std::vector<float>& to_points, double distance, double slack,
                           const RunContext& run) {
    TreatedHoles treated;
    auto& [result, report] = treated;
    holes::CutMesh cut = cut_holes(mesh, to_points, distance, slack, report, run);
    with_threads(run, [&, &result = result] {
        std::vector<char> fixed(cut.mesh.vertices.size(), 0), spans(cut.mesh.vertices.size(), 0);
        for (std::size_t t = 0; t < cut.kept.size(); ++t)
            if (cut.kept[t])
                for (const std::uint32_t v : cut.mesh.triangles[t]) fixed[v] = 1;
        // A patch over a hole that borders no kept triangle has no rim to which it could be attached, and is removed.
        detail::DisjointSets patches = parts_of(cut, false);
        for (std::uint32_t v = 0; v < fixed.size(); ++v)
            if (fixed[v]) spans[patches.root(v)] = 1;
        std::erase_if(cut.mesh.triangles,
                      [&](const Triangle& t) { return !fixed[t[0]] && !spans[patches.root(t[0])]; });
        for (std::uint32_t v = 0; v < fixed.size(); ++v) fixed[v] = fixed[v] || !spans[patches.root(v)];
        holes::span_membrane(cut.mesh, fixed, run);
        result = std::move(cut.mesh);
        remove_small_components(result, 0);  // removes unused vertices
    });
    report.policy = Holes::Flat;
    return treated;
}

}  // namespace covol
