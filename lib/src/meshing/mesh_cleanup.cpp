#include "covol/mesh_cleanup.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/manifoldness.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/repair_self_intersections.h>
#include <CGAL/Polygon_mesh_processing/stitch_borders.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "base/disjoint_sets.h"
#include "covol/domain.h"
#include "covol/error.h"
#include "covol/mesh_relax.h"
#include "mesh/missing_vertex.h"
#include "meshing/decimate.h"
#include "meshing/mesh_distance.h"
#include "meshing/safe_moves.h"

namespace covol {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using SurfaceMesh = CGAL::Surface_mesh<Point>;

Point to_point(const std::array<float, 3>& p) { return {p[0], p[1], p[2]}; }

/// Whether two triangles have a point in common beyond the corners and the side that they share.
bool intersect(const TriangleMesh& mesh, std::size_t a, std::size_t b) {
    auto t = mesh.triangles[a];
    auto s = mesh.triangles[b];
    // Moves the shared corners to the front, in the same order in both triangles.
    int shared = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = shared; j < 3; ++j)
            if (i >= shared && t[i] == s[j]) {
                std::swap(t[shared], t[i]);
                std::swap(s[shared], s[j]);
                ++shared;
                i = shared - 1;
                break;
            }
    const auto corner = [&](std::uint32_t v) { return to_point(mesh.vertices[v]); };
    const Kernel::Triangle_3 first(corner(t[0]), corner(t[1]), corner(t[2]));
    const Kernel::Triangle_3 second(corner(s[0]), corner(s[1]), corner(s[2]));
    if (first.is_degenerate() || second.is_degenerate()) return false;
    switch (shared) {
        case 0: return CGAL::do_intersect(first, second);
        case 1:
            return CGAL::do_intersect(first, Kernel::Segment_3(corner(s[1]), corner(s[2]))) ||
                   CGAL::do_intersect(second, Kernel::Segment_3(corner(t[1]), corner(t[2])));
        case 2:  // a common side: whether one triangle is folded flat onto the other
            return CGAL::coplanar(corner(t[0]), corner(t[1]), corner(t[2]), corner(s[2])) &&
                   CGAL::coplanar_orientation(corner(t[0]), corner(t[1]), corner(t[2]), corner(s[2])) == CGAL::POSITIVE;
        default: return true;
    }
}

SurfaceMesh to_surface_mesh(const TriangleMesh& mesh) {
    std::vector<Point> points;
    points.reserve(mesh.vertices.size());
    for (const auto& p : mesh.vertices) points.push_back(to_point(p));
    std::vector<std::vector<std::size_t>> triangles;
    triangles.reserve(mesh.triangles.size());
    for (const auto& t : mesh.triangles) triangles.push_back({t[0], t[1], t[2]});
    pmp::repair_polygon_soup(points, triangles);
    pmp::orient_polygon_soup(points, triangles);
    SurfaceMesh result;
    pmp::polygon_soup_to_polygon_mesh(points, triangles, result);
    return result;
}

TriangleMesh from_surface_mesh(SurfaceMesh& source, const Vec3& origin) {
    source.collect_garbage();
    TriangleMesh mesh;
    mesh.origin = origin;
    mesh.vertices.reserve(source.number_of_vertices());
    for (const auto v : source.vertices()) {
        const Point& p = source.point(v);
        mesh.vertices.push_back({float(p.x()), float(p.y()), float(p.z())});
    }
    mesh.triangles.reserve(source.number_of_faces());
    for (const auto f : source.faces()) {
        std::array<std::uint32_t, 3> t{};
        int k = 0;
        for (const auto v : CGAL::vertices_around_face(source.halfedge(f), source)) t[k++] = std::uint32_t(v.idx());
        mesh.triangles.push_back(t);
    }
    return mesh;
}

/// @return the number of holes that were filled, without those for which CGAL finds no triangulation
int fill_holes(SurfaceMesh& mesh) {
    std::vector<SurfaceMesh::Halfedge_index> borders;
    pmp::extract_boundary_cycles(mesh, std::back_inserter(borders));
    int filled = 0;
    for (const auto border : borders) {
        std::vector<SurfaceMesh::Face_index> patch;
        pmp::triangulate_hole(mesh, border, std::back_inserter(patch));
        filled += !patch.empty();
    }
    return filled;
}

/// Fills holes, separates parts of the surface at non-manifold vertices, and removes self-intersections. @return the
/// number of filled holes, including those that the removal of self-intersections left
int repair(SurfaceMesh& mesh) {
    pmp::stitch_borders(mesh);
    pmp::duplicate_non_manifold_vertices(mesh);
    int holes = fill_holes(mesh);
    pmp::remove_degenerate_faces(mesh);
    if (pmp::does_self_intersect(mesh)) {
        pmp::experimental::remove_self_intersections(mesh, CGAL::parameters::preserve_genus(false));
        pmp::stitch_borders(mesh);
        pmp::duplicate_non_manifold_vertices(mesh);
        holes += fill_holes(mesh);
    }
    if (CGAL::is_closed(mesh) && !pmp::does_self_intersect(mesh)) pmp::orient_to_bound_a_volume(mesh);
    return holes;
}

/// Number of equilateral triangles of this edge length that cover `area`; at least 4, as in a tetrahedron.
std::size_t triangles_of(double edge, double area) {
    return std::size_t(std::max(4.0, area / (std::sqrt(3.0) / 4 * edge * edge)));
}

/// A mesh, and the level set that it represents, if known.
struct Work {
    TriangleMesh& mesh;
    const FloatGrid* level_set;
    double isovalue;
    const CleanupOptions& options;
    const RunContext& run;

    [[nodiscard]] double voxel_size() const { return domain_of(*level_set).voxel_size; }
};

/// The larger of the distances from `before` to `after`, which detect parts that were lost, and from `after` to
/// `before`, which detect parts that were added.
MeshDeviation change_of(const TriangleMesh& before, const TriangleMesh& after) {
    const auto samples = [](const TriangleMesh& mesh) {
        std::vector<Vec3> points;
        for (std::size_t v = 0; v < mesh.vertices.size(); ++v) points.push_back(mesh.place(v));
        for (const auto& t : mesh.triangles) {
            Vec3 middle{};
            for (const std::uint32_t v : t) middle = plus(middle, 1.0 / 3, mesh.place(v));
            points.push_back(middle);
        }
        return points;
    };
    MeshDeviation worst;
    for (const auto& [from, to] : {std::pair(&before, &after), std::pair(&after, &before)}) {
        const FitStatistics fit = detail::statistics_of(detail::distances_to(*to, samples(*from)));
        worst = {std::max(worst.max, fit.max), std::max(worst.mean, fit.mean)};
    }
    return worst;
}

CleanupStep step_report(const Work& work, const TriangleMesh& before) {
    CleanupStep step{
        std::int64_t(work.mesh.triangles.size()), smallest_angle(work.mesh), change_of(before, work.mesh), {}};
    if (work.level_set != nullptr)
        step.deviation = measure_deviation(*work.level_set, work.mesh, work.isovalue, work.run);
    return step;
}

/// Restores the volume by a constant offset along the normals: the triangles of a mesh whose vertices lie on a round
/// solid enclose less volume than the solid. Vertices on the faces of a clip are not moved.
void keep_volume(TriangleMesh& mesh, const MeshMeasures& before, const meshing::Surface* surface) {
    const MeshMeasures after = measure(mesh);
    if (!before.closed || !after.closed || !(after.area > 0)) return;
    const auto offset = static_cast<float>((before.volume - after.volume) / after.area);
    const auto normals = compute_vertex_normals(mesh);
    std::optional<meshing::Level> level;
    if (surface != nullptr) level.emplace(surface->level());
    meshing::Positions goal = mesh.vertices;
    for (std::size_t v = 0; v < goal.size(); ++v)
        for (int a = 0; a < 3 && !(level && level->faces(goal[v]) != 0); ++a) goal[v][a] += offset * normals[v][a];
    meshing::move_where_free(mesh, goal);
}

CleanupStep decimate(const Work& work, const MeshMeasures& facts) {
    constexpr int kRounds = 3;  // rounds of relaxation after decimation
    const TriangleMesh before = work.mesh;
    std::optional<meshing::Surface> surface;
    if (work.level_set != nullptr) surface.emplace(*work.level_set, work.isovalue, work.mesh.origin);
    const double tolerance = work.options.adaptive > 0 ? work.options.adaptive / work.voxel_size() : 0.0;
    const std::size_t triangles = work.options.target_edge > 0 ? triangles_of(work.options.target_edge, facts.area) : 4;
    meshing::decimate(work.mesh, surface ? &*surface : nullptr, {triangles, tolerance}, work.run);
    if (surface) relax_mesh(work.mesh, *work.level_set, {work.isovalue, kRounds, tolerance}, work.run);
    if (!(tolerance > 0)) keep_volume(work.mesh, facts, surface ? &*surface : nullptr);
    return step_report(work, before);
}

/// A step of Laplacian smoothing: moves each vertex by the fraction `weight` of the way to the mean of its neighbours.
void smooth_step(TriangleMesh& mesh, double weight) {
    std::vector<std::array<double, 4>> sums(mesh.vertices.size(), std::array<double, 4>{});
    for (const auto& t : mesh.triangles)
        for (int k = 0; k < 3; ++k)
            for (int other = 1; other < 3; ++other) {
                for (int c = 0; c < 3; ++c) sums[t[k]][c] += mesh.vertices[t[(k + other) % 3]][c];
                sums[t[k]][3] += 1;
            }
    for (std::size_t v = 0; v < sums.size(); ++v)
        for (int c = 0; sums[v][3] > 0 && c < 3; ++c)
            mesh.vertices[v][c] += float(weight * (sums[v][c] / sums[v][3] - mesh.vertices[v][c]));
}

/// Taubin 1995: alternates a shrinking and an inflating step. Because their weights have nearly equal magnitudes, low
/// frequencies, and with them the volume, grow by less than 1e-4 per iteration.
CleanupStep smooth(const Work& work, bool proper) {
    const TriangleMesh before = work.mesh;
    for (int i = 0; i < work.options.smooth_iterations; ++i) {
        smooth_step(work.mesh, 0.5);
        smooth_step(work.mesh, -0.51);
        work.run.check();
    }
    if (proper) {
        meshing::Positions goal = before.vertices;
        goal.swap(work.mesh.vertices);
        meshing::move_where_free(work.mesh, goal);
    }
    return step_report(work, before);
}

/// Runs a function that uses CGAL and converts its exceptions to Error.
void guarded(const std::function<void()>& work) {
    try {
        work();
    } catch (const CGAL::Failure_exception& e) {
        throw Error(Errc::InvalidInput, std::string("the mesh cannot be repaired: ") + e.what());
    }
}

void check_indices(const TriangleMesh& mesh, const char* where) {
    for (const auto& t : mesh.triangles)
        for (const std::uint32_t v : t)
            if (v >= mesh.vertices.size())
                throw Error(Errc::InvalidInput,
                            std::string(where) + ": a triangle " + detail::refers_to_missing(v, mesh.vertices.size()));
}

}  // namespace

int count_self_intersections(const TriangleMesh& mesh) {
    const Crossings crossings = count_crossings(mesh);
    return crossings.within + crossings.between;
}

Crossings count_crossings(const TriangleMesh& mesh) {
    check_indices(mesh, "count_self_intersections");
    detail::DisjointSets pieces(mesh.vertices.size());
    for (const auto& t : mesh.triangles) {
        pieces.unite(t[0], t[1]);
        pieces.unite(t[1], t[2]);
    }
    std::vector<std::uint32_t> piece_of(mesh.triangles.size());
    for (std::size_t n = 0; n < piece_of.size(); ++n) piece_of[n] = pieces.root(mesh.triangles[n][0]);
    // contacts() omits pairs of triangles that are certainly apart; exact predicates decide on the others.
    const std::vector<meshing::ContactFinder::Pair> pairs =
        meshing::ContactFinder(mesh.vertices, mesh.triangles).contacts(false);
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, pairs.size()), Crossings{},
        [&](const auto& range, Crossings count) {
            for (std::size_t i = range.begin(); i < range.end(); ++i) {
                const auto [a, b] = pairs[i];
                if (intersect(mesh, a, b)) ++(piece_of[a] == piece_of[b] ? count.within : count.between);
            }
            return count;
        },
        [](const Crossings& a, const Crossings& b) {
            return Crossings{a.within + b.within, a.between + b.between};
        });
}

namespace {

CleanupReport clean(const Work& work) {
    TriangleMesh& mesh = work.mesh;
    const FloatGrid* const level_set = work.level_set;
    const CleanupOptions& options = work.options;
    const RunContext& run = work.run;
    require_valid(options, "clean_mesh");
    if (options.adaptive > 0 && (level_set == nullptr || options.adaptive > 2 * work.voxel_size()))
        throw Error(Errc::InvalidOptions, level_set == nullptr
                                              ? std::string("adaptive: expected the level set of the mesh, got none")
                                              : "adaptive: expected at most two voxels, " +
                                                    std::to_string(2 * work.voxel_size()) + ", got " +
                                                    std::to_string(options.adaptive));
    check_indices(mesh, "clean_mesh");
    CleanupReport report;
    with_threads(run, [&] {
        report.self_intersections = count_self_intersections(mesh);
        MeshMeasures facts = measure(mesh);
        int intersections = report.self_intersections;
        const auto repair_where_needed = [&] {
            if (!options.repair || (facts.closed && facts.manifold && facts.volume > 0 && intersections == 0)) return;
            guarded([&] {
                SurfaceMesh soup = to_surface_mesh(mesh);
                report.holes_filled += repair(soup);
                mesh = from_surface_mesh(soup, mesh.origin);
            });
            facts = measure(mesh);
            intersections = count_self_intersections(mesh);
        };
        run.report("clean", 0.2);
        run.check();
        repair_where_needed();
        run.report("clean", 0.4);
        run.check();
        if (options.target_edge > 0 || options.adaptive > 0) report.decimation = decimate(work, facts);
        run.report("clean", 0.6);
        if (options.smooth_iterations > 0) report.smoothing = smooth(work, facts.closed && facts.manifold);
        run.report("clean", 0.8);
        if (report.decimation || report.smoothing) {
            facts = measure(mesh);
            intersections = count_self_intersections(mesh);
            repair_where_needed();
        }
        report.closed = facts.closed;
        report.manifold = facts.manifold;
        report.intersection_free = intersections == 0;
        run.report("clean", 1.0);
    });
    return report;
}

}  // namespace

CleanupReport clean_mesh(TriangleMesh& mesh, const CleanupOptions& options, const RunContext& run) {
    return clean({mesh, nullptr, 0.0, options, run});
}

CleanupReport clean_mesh(TriangleMesh& mesh, const FloatGrid& level_set, double isovalue, const CleanupOptions& options,
                         const RunContext& run) {
    return clean({mesh, &level_set, isovalue, options, run});
}

}  // namespace covol
