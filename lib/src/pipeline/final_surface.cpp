#include "pipeline/final_surface.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>

#include "covol/clip.h"
#include "covol/compare.h"
#include "covol/evidence.h"
#include "detail/mesh_distance.h"
#include "pipeline/doubts.h"

namespace covol::pipeline {
namespace {

constexpr double kFarFromPoints = 3.0;       // voxels and spacings: no point holds the surface there
constexpr double kWarnWithoutPoints = 0.02;  // share of the area

/// Where a solid ends whatever the marks say: the image's box, and the region of interest.
Clip where_it_ends(const Job& job) {
    Clip all = job.image != nullptr ? clip_at(job.image->geometry()) : Clip{};
    if (!job.options.roi) return all;
    const Clip region = clip_at(*job.options.roi);
    all.insert(all.end(), region.begin(), region.end());
    return all;
}

/// @return what counts as far
double find_bare_surface(Job& job) {
    RunContext quiet;  // beside another task nothing may be reported
    quiet.threads = job.run.threads;
    quiet.cancel = job.run.cancel;
    const double reach = kFarFromPoints * std::max(job.h(), nearest_neighbour_spacing(job.points).median);
    const FloatGridPtr& known = job.result.distance;
    job.report().share_without_points = known && known->background() >= float(reach)
                                            ? share_without_points(job.result.mesh, *known, reach, quiet)
                                            : share_without_points(job.result.mesh, job.points, reach, quiet);
    return reach;
}

}  // namespace

void make_surface(Job& job) {
    SegmentReport& report = job.report();
    Timed timed(report.seconds.surface);
    set_clip(*job.result.u, where_it_ends(job));
    job.result.surface = surface(*job.result.u, job.run);
    job.result.mesh = extract_mesh(*job.result.surface, job.options.extract, job.run);
    // Parts of each of these run on one thread.
    double reach = 0;
    std::vector<double> distances;
    const std::vector<Vec3>& marks = job.options.contours ? job.given : job.marks;
    tbb::parallel_invoke([&] { report.surface = measure(job.result.mesh); },
                         [&] { if (!job.points.empty()) distances = detail::distances_to(job.result.mesh, marks); },
                         [&] { if (!job.points.empty() && job.image == nullptr) reach = find_bare_surface(job); });
    if (!distances.empty()) {
        report.fit = detail::statistics_of(distances);
        doubt(job, marks, distances);
    }
    if (job.origin == StartOrigin::Guess && report.surface.components > 1)
        job.warn("the surface through the marks falls into " + std::to_string(report.surface.components) +
                 " pieces: where they are one body, mark between them; several bodies are better marked each by itself");
    report.seeds = check_seeds(*job.result.surface, job.options.inside, job.options.outside);
    if (const std::string warning = report.seeds.warning(); !warning.empty()) job.warn("seeds: " + warning);
    if (report.share_without_points > kWarnWithoutPoints)
        job.warn(number(std::round(1000 * report.share_without_points) / 10) +
                     " % of the surface lie farther than " + number(reach) +
                     " from every point: there curvature alone closes it");
}

}  // namespace covol::pipeline
