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
#include <CGAL/box_intersection_d.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "covol/error.h"
#include "detail/mesh_decimate.h"

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
    // Shared corners first, in the same order in both.
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
        case 2:  // folded onto each other
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

TriangleMesh from_surface_mesh(SurfaceMesh& source) {
    source.collect_garbage();
    TriangleMesh mesh;
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

int fill_holes(SurfaceMesh& mesh) {
    std::vector<SurfaceMesh::Halfedge_index> borders;
    pmp::extract_boundary_cycles(mesh, std::back_inserter(borders));
    for (const auto border : borders) {
        std::vector<SurfaceMesh::Face_index> patch;
        pmp::triangulate_hole(mesh, border, std::back_inserter(patch));
    }
    return int(borders.size());
}

/// Returns the number of holes that were filled.
int repair(SurfaceMesh& mesh) {
    pmp::stitch_borders(mesh);
    pmp::duplicate_non_manifold_vertices(mesh);
    int holes = fill_holes(mesh);
    pmp::remove_degenerate_faces(mesh);
    if (pmp::does_self_intersect(mesh)) {
        pmp::experimental::remove_self_intersections(mesh, CGAL::parameters::preserve_genus(false));
        pmp::stitch_borders(mesh);
        pmp::duplicate_non_manifold_vertices(mesh);
        fill_holes(mesh);
    }
    if (CGAL::is_closed(mesh) && !pmp::does_self_intersect(mesh)) pmp::orient_to_bound_a_volume(mesh);
    return holes;
}

/// Equilateral triangles of this edge length that cover `area`.
std::size_t triangles_of(double edge, double area) {
    return std::size_t(std::max(4.0, area / (std::sqrt(3.0) / 4 * edge * edge)));
}

/// Decimation leaves a subset of the vertices, so that a round solid loses volume; an even offset along the normals
/// brings it back.
void decimate_keeping_volume(TriangleMesh& mesh, double target_edge, const MeshMeasures& before) {
    detail::decimate(mesh, triangles_of(target_edge, before.area));
    const MeshMeasures after = measure(mesh);
    if (!before.closed || !after.closed || !(after.area > 0)) return;
    const auto offset = static_cast<float>((before.volume - after.volume) / after.area);
    const auto normals = vertex_normals(mesh);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        for (int a = 0; a < 3; ++a) mesh.vertices[v][a] += offset * normals[v][a];
}

/// One step of Laplacian smoothing with this weight.
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

/// Taubin 1995: a shrinking and an inflating step in turn. Weights of nearly the same size keep the gain at low
/// frequencies, and with it the growth of the volume, below 1e-4 an iteration.
void smooth(TriangleMesh& mesh, int iterations, const RunContext& run) {
    for (int i = 0; i < iterations; ++i) {
        smooth_step(mesh, 0.5);
        smooth_step(mesh, -0.51);
        run.check();
    }
}

/// Runs CGAL's part; what CGAL throws becomes an Error.
void guarded(const std::function<void()>& work) {
    try {
        work();
    } catch (const CGAL::Failure_exception& e) {
        throw Error(Errc::InvalidInput, std::string("clean_mesh: the mesh cannot be repaired: ") + e.what());
    }
}

void check_indices(const TriangleMesh& mesh, const char* where) {
    for (const auto& t : mesh.triangles)
        for (const std::uint32_t v : t)
            if (v >= mesh.vertices.size())
                throw Error(Errc::InvalidInput, std::string(where) + ": a triangle refers to vertex " + std::to_string(v) +
                                                    " of " + std::to_string(mesh.vertices.size()));
}

}  // namespace

std::string CleanupOptions::why_invalid() const {
    std::string why;
    if (!(target_edge >= 0) || !std::isfinite(target_edge))
        why += "target_edge: expected >= 0, got " + std::to_string(target_edge) + "\n";
    if (smooth_iterations < 0)
        why += "smooth_iterations: expected >= 0, got " + std::to_string(smooth_iterations) + "\n";
    return why;
}

int count_self_intersections(const TriangleMesh& mesh) {
    check_indices(mesh, "count_self_intersections");
    using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::size_t>;
    std::vector<Box> boxes;
    boxes.reserve(mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        CGAL::Bbox_3 box;
        for (const std::uint32_t v : mesh.triangles[t]) box += to_point(mesh.vertices[v]).bbox();
        boxes.emplace_back(box, t);
    }
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box& a, const Box& b) {
        pairs.emplace_back(a.info(), b.info());
    });
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, pairs.size()), 0,
        [&](const auto& range, int count) {
            for (std::size_t i = range.begin(); i < range.end(); ++i)
                count += intersect(mesh, pairs[i].first, pairs[i].second);
            return count;
        },
        std::plus<>());
}

CleanupReport clean_mesh(TriangleMesh& mesh, const CleanupOptions& options, const RunContext& run) {
    if (const std::string why = options.why_invalid(); !why.empty()) throw Error(Errc::InvalidOptions, "clean_mesh: " + why);
    check_indices(mesh, "clean_mesh");
    CleanupReport report;
    with_threads(run, [&] {
        report.self_intersections = count_self_intersections(mesh);
        MeshMeasures facts = measure(mesh);
        const auto is_good = [&](int intersections) {
            return facts.closed && facts.manifold && facts.volume > 0 && intersections == 0;
        };
        const auto repair_mesh = [&] {
            guarded([&] {
                SurfaceMesh work = to_surface_mesh(mesh);
                report.holes_filled += repair(work);
                mesh = from_surface_mesh(work);
            });
            facts = measure(mesh);
        };
        run.report("clean", 0.2);
        run.check();
        int intersections = report.self_intersections;
        if (options.repair && !is_good(intersections)) {
            repair_mesh();
            intersections = count_self_intersections(mesh);
        }
        run.report("clean", 0.4);
        run.check();
        if (options.target_edge > 0)
            decimate_keeping_volume(mesh, options.target_edge, facts);
        smooth(mesh, options.smooth_iterations, run);
        run.report("clean", 0.8);
        if (options.target_edge > 0 || options.smooth_iterations > 0) {
            facts = measure(mesh);
            intersections = count_self_intersections(mesh);
            if (options.repair && !is_good(intersections)) {
                repair_mesh();
                intersections = count_self_intersections(mesh);
            }
        }
        report.closed = facts.closed;
        report.manifold = facts.manifold;
        report.intersection_free = intersections == 0;
        run.report("clean", 1.0);
    });
    return report;
}

}  // namespace covol
