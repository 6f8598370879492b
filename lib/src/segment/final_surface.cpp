#include "segment/final_surface.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>

#include "cloud/surface/hold_topology.h"
#include "covol/clip.h"
#include "covol/compare.h"
#include "covol/mesh_stream.h"
#include "covol/start.h"
#include "holes/share_beyond.h"
#include "meshing/level_set_distance.h"
#include "meshing/mesh_distance.h"
#include "segment/doubts.h"
#include "segment/heuristics.h"

namespace covol::pipeline {
namespace {

constexpr std::size_t kLoopsToTell = 8;

void relax(Job& job) {
    job.report().mesh = relax_mesh(job.result.mesh, *job.result.surface, {job.options.extract.isovalue}, job.run);
}

/// The surface of u, which is given up where nobody wants it.
void surface_of_flow(Job& job) {
    if (job.result.surface) return;
    FloatGridPtr& u = job.result.u;
    set_clip(*u, job.where_it_ends());
    job.result.surface = extract_surface(*u, job.run);
    const bool is_field = job.rests_on_field();
    if (is_field) {
        SegmentReport& report = job.report();
        report.active_voxels = report.solve.active_voxels = std::int64_t(job.result.surface->activeVoxelCount());
        report.leaf_count = report.solve.leaf_count = std::int64_t(job.result.surface->tree().leafCount());
    }
    if (job.options.without_fields) return u.reset();
    if (!is_field) return;
    u = start_from_grid(job.domain(), *u, job.run);
    set_clip(*u, job.where_it_ends());
}

void mesh_of_surface(Job& job) {
    job.result.mesh = extract_mesh(*job.result.surface, job.options.extract, job.run);
    relax(job);
}

void mesh_of(Job& job, const FloatGrid& level_set) {
    job.result.surface = extract_surface(level_set, job.run);
    mesh_of_surface(job);
}

int complexity(const MeshMeasures& m) { return m.components + std::max(0, m.genus); }

/// Makes level set and mesh those of another closed mesh, with no more pieces and handles than they had.
void replace_by(Job& job, const TriangleMesh& mesh) {
    const int before = complexity(measure(job.result.mesh));
    const FloatGridPtr rough = job.result.surface;
    FloatGridPtr level_set = start_from_mesh(job.domain(), mesh, job.run);
    mesh_of(job, *level_set);
    if (complexity(measure(job.result.mesh)) <= before) return;
    cloud::hold_topology(*rough, *level_set, job.run);
    mesh_of(job, *start_from_grid(job.domain(), *level_set, job.run));
}

/// A surface that points alone hold may have holes between them.
bool may_have_holes(const Job& job) { return !job.points.empty() && job.image == nullptr; }

/// Without stray ones.
const std::vector<Vec3>& points_of_surface(const Job& job) { return job.cloud ? job.cloud->points : job.points; }

/// How much of the surface no point holds, and what becomes of that.
void treat_holes(Job& job) {
    SegmentReport& report = job.report();
    TriangleMesh& mesh = job.result.mesh;
    std::vector<float>& distances = job.result.distance_to_points;
    const std::vector<Vec3>& points = points_of_surface(job);
    const HolesOptions& options = job.options.holes;
    const double automatic = choose_hole_distance(points, job.h()), distance = options.distance.value_or(automatic);
    const double slack = kFinal.rim_slack * std::min(automatic, distance);
    distances = measure_distances(mesh, points, job.run);
    report.share_without_points = measure_share_beyond(mesh, distances, distance);
    report.holes.policy = options.policy;
    report.holes.distance = distance;
    if (options.policy == Holes::Close) return;
    if (options.policy == Holes::Open) {
        const double volume = measure(mesh).volume;
        mesh = trim_holes(mesh, distances, distance, slack, report.holes, job.run);
        if (report.holes.share > 0) {
            report.holes.closed_volume = volume;
            relax(job);
        }
    }
    if (options.policy == Holes::Flat) {
        const TriangleMesh flat = flatten_holes(mesh, distances, distance, slack, report.holes, job.run);
        if (report.holes.share > 0) replace_by(job, flat);
    }
    if (report.holes.share > 0) distances = measure_distances(mesh, points, job.run);
    std::string lengths;
    for (std::size_t n = 0; n < report.holes.loops.size() && n < kLoopsToTell; ++n)
        lengths += (n > 0 ? ", " : "") + number(report.holes.loops[n].length);
    job.choose("holes", to_string(options.policy),
               report.holes.loops.empty() ? "none: all of the surface is within " + number(distance) + " of points"
                                          : std::to_string(report.holes.loops.size()) + " rims, of length " + lengths +
                                                (report.holes.loops.size() > kLoopsToTell ? ", ..." : "") +
                                                (options.policy == Holes::Open ? "; the level set stays closed" : ""));
}

/// Measures the surface. @return the marks' distances to it
std::vector<double> measure_without_mesh(Job& job, const std::vector<Vec3>& marks) {
    SegmentReport& report = job.report();
    StreamedMesh mesh;
    if (may_have_holes(job)) {
        const std::vector<Vec3>& points = points_of_surface(job);
        report.holes.distance =
            job.options.holes.distance ? *job.options.holes.distance : choose_hole_distance(points, job.h());
        const detail::BeyondPoints measured =
            detail::measure_beyond(*job.result.surface, points, report.holes.distance, job.run);
        report.share_without_points = measured.share;
        mesh = measured.mesh;
    } else {
        mesh = measure_surface(*job.result.surface, 0, job.run);
    }
    report.surface = mesh.measures;
    report.mesh.triangles = std::int64_t(mesh.triangles);
    return job.points.empty() ? std::vector<double>{} : detail::distances_to(*job.result.surface, marks);
}

/// The same by way of the mesh, which stays.
std::vector<double> make_mesh(Job& job, const std::vector<Vec3>& marks) {
    SegmentReport& report = job.report();
    mesh_of_surface(job);
    if (may_have_holes(job)) treat_holes(job);
    // Parts of each of these run on one thread.
    std::vector<double> distances;
    tbb::parallel_invoke([&] { report.surface = measure(job.result.mesh); },
                         [&] {
                             if (!job.points.empty()) distances = detail::distances_to(job.result.mesh, marks);
                         });
    if (report.holes.closed_volume > 0) report.surface.volume = report.holes.closed_volume;
    return distances;
}

void give_up_fields(Job& job) {
    job.trusted_distance = job.obstacle = job.floor = nullptr;
    if (job.options.without_fields) job.result.distance = job.result.edge = nullptr;
}

}  // namespace

void make_surface(Job& job) {
    SegmentReport& report = job.report();
    Timed timed(report.seconds.surface);
    give_up_fields(job);
    surface_of_flow(job);
    const std::vector<Vec3>& marks = job.options.contours ? job.given : job.marks;
    const std::vector<double> distances =
        job.options.without_mesh ? measure_without_mesh(job, marks) : make_mesh(job, marks);
    if (!distances.empty()) {
        report.fit = detail::statistics_of(distances);
        doubt(job, marks, distances);
    }
    if (job.origin == StartOrigin::Guess && report.surface.components > 1)
        job.warn(
            "the surface through the marks falls into " + std::to_string(report.surface.components) +
            " pieces: where they are one body, mark between them; several bodies are better marked each by itself");
    if (const int genus = report.surface.genus; job.origin == StartOrigin::Guess && genus > 1 &&
                                                double(report.guess.marks) < kFinal.marks_of_handle * double(genus))
        job.warn(
            "the surface has " + std::to_string(genus) + " handles on " + std::to_string(report.guess.marks) +
            " marks: where the body has no holes its walls are thinner than the marks are off; more marks there, or "
            "better ones, close them");
    report.seeds = check_seeds(*job.result.surface, job.options.inside, job.options.outside);
    if (const std::string warning = report.seeds.warning(); !warning.empty()) job.warn("seeds: " + warning);
    if (report.share_without_points > kFinal.warn_without_points)
        job.warn(number(std::round(1000 * report.share_without_points) / 10) + " % of the surface lie farther than " +
                 number(report.holes.distance) + " from every point: " +
                 (report.holes.policy == Holes::Close ? "there curvature alone closes it"
                  : report.holes.policy == Holes::Flat
                      ? "there flat patches close it"
                      : "there the mesh is open, the level set closed by curvature alone"));
}

}  // namespace covol::pipeline
