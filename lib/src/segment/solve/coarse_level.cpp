#include "segment/solve/coarse_level.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <utility>

#include "covol/start.h"
#include "redistance/no_surface.h"
#include "segment/heuristics.h"

namespace covol::pipeline {
namespace {

constexpr int kRefinement = 2;  // factor of the voxel size from one level to the next: SegmentOptions::coarse_levels

bool is_large(const Domain& d) {
    int minimum = d.max[0] - d.min[0];
    for (int a = 1; a < 3; ++a) minimum = std::min(minimum, d.max[a] - d.min[a]);
    return minimum >= kFlow.min_coarsened;
}

/// The requested number of levels; by default one for a sphere or box that was not grown, in a large domain, because
/// such a start may be far from the surface, and none for other starts.
int levels_of(const SegmentOptions& options, const StartFacts& start) {
    if (options.coarse_levels) return *options.coarse_levels;
    const bool is_rough = is_any<SphereStart, BoxStart>(options.start);
    return is_rough && start.origin != StartOrigin::Grown && is_large(start.domain) ? 1 : 0;
}

EvolveOptions coarsened(EvolveOptions flow, double h) {
    flow.follow = true;
    flow.tolerance = std::max(flow.tolerance, kFlow.rough_tolerance);
    if (flow.tau)
        *flow.tau *= kRefinement;
    else if (uses_image(flow) && flow.image_yields.value_or(0) == 0)  // otherwise the time step grows automatically
        flow.tau = kFlow.rough_tau * h;
    if (const double range = flow.attraction_range.value_or(0); range > 0)
        flow.attraction_range = std::max(range, kHalfWidthVoxels * h);
    return flow;
}

// Moves the coarse result back towards the start: edges that are a few voxels apart merge on the coarse level, and the
// fine level has to reach them from the start's side. Clamped values of the band must not change sign, which limits the
// distance.
void step_back(FloatGrid& u, const FloatGrid& start, double h) {
    const auto back = static_cast<float>((kHalfWidthVoxels - 1) * h);
    const auto start_at = start.getConstAccessor();
    for (auto v = u.beginValueOn(); v; ++v)
        v.setValue(std::clamp(start_at.getValue(v.getCoord()), *v - back, *v + back));
}

EdgeOptions coarsened(EdgeOptions edge, double h) {
    edge.sigma = std::max(edge.sigma.value_or(0), 0.5 * h);  // details finer than a voxel are not sampled
    return edge;
}

/// `start` on a lattice of voxel size h; u is null if nothing of it remains at that size.
StartSurface coarsened(const Problem& problem, const StartSurface& start, double h) {
    StartSurface coarse;
    StartFacts& facts = coarse.facts;
    facts.origin = start.facts.origin;
    facts.domain = problem.coarsened(start.facts.domain, h);
    facts.marks.attracting = start.facts.marks.attracting;
    facts.flow = coarsened(start.facts.flow, h);
    facts.tag_distance = start.facts.tag_distance;
    try {
        coarse.u = start_from_grid(facts.domain, *start.u, problem.run);
    } catch (const NoSurface&) {
        return coarse;
    }
    if (facts.tag_distance && uses_points(facts.flow))
        coarse.distance = find_distance(facts.marks.attracting, facts.domain, *facts.tag_distance + band_slack(h), 0,
                                        facts.report, problem.run);
    else
        coarse.distance = find_distance_for_flow(facts, *coarse.u, facts.report, problem.run);
    return coarse;
}

/// Solves the levels from the coarsest to the one above `start`.
CoarsePass pass(const Problem& problem, const StartSurface& start, const EdgeOptions& fine_edge, int levels) {
    CoarsePass result;
    const Timed timed(result.report.seconds.coarse);
    const double h = kRefinement * start.h();
    const EdgeOptions edge = coarsened(fine_edge, h);
    StartSurface coarse = coarsened(problem, start, h);
    SegmentReport::CoarseLevel level{h, 0, 0, "the start is too small for such a coarse lattice"};
    if (coarse.u) {
        const FloatGridPtr before = coarse.u->deepCopy();
        if (levels > 1) {
            CoarsePass coarser = pass(problem, coarse, edge, levels - 1);
            result.reports = std::move(coarser.reports);
            if (coarser.u) coarse = from_coarse_level(std::move(coarse), coarser.u);
        }
        const Solution solution = flow(problem, std::move(coarse), edge);
        level = {h, solution.solve.steps, solution.solve.active_voxels, "the surface vanished on it"};
        if (!solution.has_vanished()) {
            level.why_not.clear();
            if (!start.facts.tag_distance) step_back(*solution.u, *before, h);
            result.u = start_from_grid(start.facts.domain, *solution.u, problem.run);
        }
    }
    if (!result.u) problem.run.info("coarse level " + number(h) + " left out: " + level.why_not);
    result.reports.push_back(level);
    return result;
}

}  // namespace

StartSurface from_coarse_level(StartSurface start, const FloatGridPtr& u) {
    start.u = u;
    start.facts.flow.follow = true;
    start.facts.origin = StartOrigin::CoarseLevel;
    return start;
}

CoarsePass pass_coarse_levels(const Problem& problem, const StartSurface& start, const EdgeOptions& edge) {
    const int levels = levels_of(problem.options, start.facts);
    CoarsePass result;
    if (levels > 0 && !start.obstacle && !is_final_start(problem, start.facts, edge.feature) &&
        start.facts.origin != StartOrigin::Contours)
        result = pass(problem, start, edge, levels);
    result.levels = levels;
    return result;
}

}  // namespace covol::pipeline
