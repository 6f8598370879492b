#include "segment/coarse_level.h"

#include <openvdb/openvdb.h>

#include <algorithm>

#include "covol/error.h"
#include "covol/start.h"
#include "segment/fields.h"
#include "segment/flow.h"
#include "segment/heuristics.h"

namespace covol::pipeline {
namespace {

/// Where the way to the surface may be long: tagging and a result of another run end beside it.
bool knows_nothing(Start::Kind kind) { return kind == Start::Kind::Sphere || kind == Start::Kind::Box; }

bool is_large(const Domain& d) {
    int least = d.max[0] - d.min[0];
    for (int a = 1; a < 3; ++a) least = std::min(least, d.max[a] - d.min[a]);
    return least >= kCoarse.least_coarsened;
}

SegmentOptions coarsened(SegmentOptions options) {
    const double h = *(options.voxel_size = *options.voxel_size * kCoarse.refinement);
    --*options.coarse_levels;
    options.contours = nullptr;  // their points are among the others
    options.edge.sigma = std::max(options.edge.sigma.value_or(0), kCoarse.least_coarse_sigma * h);
    EvolveOptions& evolve = options.evolve;
    evolve.follow = true;
    evolve.tolerance = std::max(evolve.tolerance, kCoarse.coarse_tolerance);
    if (evolve.tau)
        *evolve.tau *= kCoarse.refinement;
    else if (evolve.rho > 0 && evolve.image_yields.value_or(0) == 0)  // else it grows by itself
        evolve.tau = kCoarse.coarse_tau * h;
    if (const double range = evolve.attraction_range.value_or(0); range > 0)
        evolve.attraction_range = std::max(range, kCoarse.least_coarse_attraction * h);
    return options;
}

// Two edges closer than a few coarse voxels are one there: the fine level comes from the same side as the start would.
void step_back(FloatGrid& u, const FloatGrid& start, double h) {
    const auto back = static_cast<float>(kCoarse.step_back * h);
    const auto start_at = start.getConstAccessor();
    for (auto v = u.beginValueOn(); v; ++v)
        v.setValue(std::clamp(start_at.getValue(v.getCoord()), *v - back, *v + back));
}

/// The flow from `start`, a level set on the lattice of `fine`. @return empty, or why its result is of no use
std::string run_coarse(Job& job, const FloatGrid& start, const Domain& fine) {
    Timed total(job.report().seconds.total);
    job.report().domain = job.coarsened(fine);
    try {
        job.result.u = start_from_grid(job.domain(), start, job.run);
    } catch (const Error& error) {
        if (error.code() != Errc::InvalidInput) throw;
        return "nothing of the start is left on so coarse a lattice";
    }
    const FloatGridPtr before = job.result.u->deepCopy();
    if (job.uses_points())
        find_distance(job, job.tags() ? job.options.tag_distance.value_or(0) + band_slack(job) : tube_for_start(job));
    pass_coarse_levels(job);
    find_edges(job);
    flow(job);
    if (has_vanished(job)) return "the surface vanished there";
    if (!job.tags()) step_back(*job.result.u, *before, job.h());
    return {};
}

}  // namespace

std::optional<FineStart> pass_coarse_levels(Job& job) {
    std::optional<int>& levels = job.options.coarse_levels;
    if (!levels)
        levels =
            knows_nothing(job.options.start.kind) && job.origin != StartOrigin::Grown && is_large(job.domain()) ? 1 : 0;
    if (levels == 0 || job.obstacle || job.rests() || job.origin == StartOrigin::Contours) return {};
    Job coarse(job.image, job.points, coarsened(job.options), job.run);
    coarse.origin = job.origin;
    const std::string why_not = run_coarse(coarse, *job.result.u, job.domain());
    SegmentReport& report = job.report();
    report.seconds.coarse += coarse.report().seconds.total;
    report.coarse = coarse.report().coarse;
    report.coarse.push_back({coarse.h(), coarse.report().solve.steps, coarse.report().active_voxels, why_not});
    if (!why_not.empty()) {
        job.run.info("coarse level " + number(coarse.h()) + " left out: " + why_not);
        return {};
    }
    Timed timed(report.seconds.coarse);
    FineStart replaced{job.result.u, job.options.edge, job.origin};
    job.result.u = start_from_grid(job.domain(), *coarse.result.u, job.run);
    job.options.evolve.follow = true;
    job.origin = StartOrigin::CoarseLevel;
    return replaced;
}

void leave_out_coarse_level(Job& job, const FineStart& start) {
    std::string& why_not = job.report().coarse.back().why_not;
    why_not = "the surface vanished after it";
    job.run.info("coarse level left out: " + why_not);
    job.result.u = start.u;
    job.options.edge = start.edge;
    job.origin = start.origin;
}

}  // namespace covol::pipeline
