#include "segment/solve/flow.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "covol/error.h"
#include "grid/levels_at.h"
#include "inference/heuristics.h"
#include "segment/heuristics.h"
#include "segment/solve/vanished.h"

namespace covol::pipeline {
namespace {

/// Adds the cost of the previous steps to `total`, the report of the later steps, which keeps all its other values.
void add(const EvolveReport& before, EvolveReport& total) {
    const double sweeps = before.sweeps_per_step * before.steps + total.sweeps_per_step * total.steps;
    total.steps += before.steps;
    total.changes.insert(total.changes.begin(), before.changes.begin(), before.changes.end());
    total.sweeps_per_step = total.steps > 0 ? sweeps / total.steps : 0.0;
    total.leaf_visits += before.leaf_visits;
    total.leaf_visits_saved += before.leaf_visits_saved;
    total.seconds_assembly += before.seconds_assembly;
    total.seconds_sweeps += before.seconds_sweeps;
}

// The first part of the flow from a tagged surface, in which only the points attract: edges of other structures in the
// image may lie between the tagged surface and the points.
EvolveReport approach(const StartFacts& start, FloatGrid& u, EvolveFields fields, const RunContext& run) {
    if (start.origin != StartOrigin::Tagged || !uses_points(start.flow) || !uses_image(start.flow)) return {};
    EvolveOptions alone = start.flow;
    alone.rho = 0;
    alone.attraction_range = 0;
    alone.image_yields = 0;
    if (alone.follow) alone.tau = kFlow.rough_tau * alone.tau.value_or(start.domain.voxel_size);
    alone.max_steps = std::min(alone.max_steps, kFlow.approach_steps);
    alone.tolerance = std::max(alone.tolerance, kFlow.rough_tolerance);
    fields.edge = nullptr;
    fields.extend = nullptr;
    return evolve(u, fields, alone, run);
}

EvolveReport approach_and_evolve(const StartFacts& start, FloatGrid& u, const EvolveFields& fields,
                                 const RunContext& run) {
    const EvolveReport before = approach(start, u, fields, run);
    if (before.stop_reason == StopReason::Vanished) return before;
    EvolveReport solved = evolve(u, fields, start.flow, run);
    add(before, solved);
    return solved;
}

/// Mean distance of positions to the zero level set, clamped to its band.
double mean_distance(const std::vector<Vec3>& places, const FloatGrid& u) {
    double sum = 0;
    for (const double level : detail::levels_at(u, places)) sum += std::abs(level);
    return sum / double(places.size());
}

double inside_volume(const FloatGrid& u) {
    double voxels = 0;
    for (auto value = u.tree().cbeginValueAll(); value; ++value)
        if (*value < 0) voxels += double(value.getVoxelCount());
    return voxels * std::pow(u.voxelSize()[0], 3);
}

std::string why_vanished(const Problem& problem, const Choices& choices, const StartFacts& start) {
    if (choices.start == StartMethod::Tagged && start.origin != StartOrigin::Contours) {
        if (problem.image == nullptr)
            return detail::why_nothing_held(start.marks.attracting, start.tag_distance.value_or(0), start.encloses);
        if (!start.encloses)
            return "the points enclose nothing, and neither points nor edges stopped it; if the structure is cut off "
                   "at the image's end, mark the cut too, or give a `tag_distance` larger than its radius; or "
                   "draw `contours`, or choose another start (`init`)";
    }
    return "nothing stopped it; lower `delta`, or start closer to the points or edges (`init`)";
}

/// Moves a surface through the marks so that the image's intensity profile between the marks matches the one at them.
FloatGridPtr query_image(const Problem& problem, const StartFacts& start, const FloatGridPtr& u, Solution& solution) {
    if (!uses_image(start.flow) || start.origin == StartOrigin::Corrected || start.origin == StartOrigin::Settled)
        return u;
    const std::vector<Vec3>& marks = start.origin == StartOrigin::Guess ? start.on_surface : start.marks.trusted;
    GuidanceOptions options;
    options.mark_precision = problem.options.mark_precision;
    options.weight = start.flow.rho;
    // For the body between contours, the range of the search is not estimated from the image: if the image matched at
    // the border of another structure, a large error of the body and therefore a large range would be estimated.
    if (start.origin == StartOrigin::Contours && problem.options.contours->slice_distance > 0)
        options.range = kFlow.contour_range * problem.options.contours->slice_distance;
    options.error_slope = start.inference.error_slope;
    if (start.inference.used) options.range = kInference.off_cells * start.domain.voxel_size;
    solution.was_requested = true;
    Guided guided = guide(*u, marks, *problem.image, options, problem.run);
    const GuidanceReport& report = solution.guidance = std::move(guided.report);
    solution.report.remarks.choose("image", report.used ? "used" : "not used", report.reason, problem.run);
    return guided.u;
}

void evolve_until_steady(const Problem& problem, StartSurface start, const EdgeOptions& edge, Solution& solution,
                         Reached* reached) {
    const RunContext& run = problem.run;
    const StartFacts& facts = solution.start;
    FloatGrid& u = *solution.u;
    Edges& edges = solution.edges = find_edges(problem, facts, u, edge);
    solution.report.add(edges.report);
    const FloatGridPtr trusted = find_trusted_distance(problem, facts, solution.report);
    EvolveFields fields;
    fields.distance = uses_points(facts.flow) ? start.distance.get() : nullptr;
    fields.trusted = trusted.get();
    fields.obstacle = start.obstacle.get();
    fields.floor = start.floor.get();
    fields.take_edge = [&](const FloatGridPtr& found, EvolveFields& f) {
        edges.grid = found;
        f.edge = found.get();
        if (reached != nullptr) reached->edge = found;
    };
    fields.take_edge(edges.grid, fields);
    double& seconds_edge = solution.report.seconds.edge;
    if (facts.flow.follow && edges.grid)
        fields.extend = [&](const FloatGrid& moved, EvolveFields& f) {
            const Timed timed(seconds_edge);
            if (const FloatGridPtr found = extended_edges(problem, facts, moved, edges)) f.take_edge(found, f);
        };
    const double edge_before = seconds_edge;
    const Timed timed(solution.report.seconds.solve);
    solution.solve = approach_and_evolve(facts, u, fields, run);
    solution.report.seconds.solve -= seconds_edge - edge_before;
}

}  // namespace

EvolveReport steady_report(const FloatGrid& u) {
    EvolveReport report;
    report.stop_reason = StopReason::Steady;
    report.active_voxels = std::int64_t(u.activeVoxelCount());
    report.leaf_count = std::int64_t(u.tree().leafCount());
    return report;
}

Solution flow(const Problem& problem, StartSurface start, const EdgeOptions& edge, Reached* reached) {
    Solution solution;
    solution.start = std::move(start.facts);
    solution.u = std::move(start.u);
    solution.distance = start.distance;
    solution.edges.options = edge;
    if (reached != nullptr) *reached = {reached->start, solution.u, solution.distance, reached->edge};
    if (!is_final_start(problem, solution.start, edge.feature)) {
        evolve_until_steady(problem, std::move(start), edge, solution, reached);
        return solution;
    }
    const Timed timed(solution.report.seconds.solve);
    solution.u = query_image(problem, solution.start, solution.u, solution);
    solution.solve = steady_report(*solution.u);
    return solution;
}

bool has_lost(const Solution& solution, const FloatGrid& start) {
    if (solution.has_vanished()) return true;
    // A grown start counts as lost if more than half of its volume has vanished.
    if (solution.start.origin == StartOrigin::Grown) return 2 * inside_volume(*solution.u) < inside_volume(start);
    const std::vector<Vec3>& trusted = solution.start.marks.trusted;
    return mean_distance(trusted, *solution.u) >
           mean_distance(trusted, start) + kAutomatic.noticeable_voxels * solution.h();
}

void check_flow(const Problem& problem, const Choices& choices, Solution& solution) {
    const EvolveReport& solved = solution.solve;
    if (solution.has_vanished())
        throw Error(Errc::InvalidInput,
                    "segment: the surface vanished after " + std::to_string(solved.steps) +
                        " steps: " + why_vanished(problem, choices, solution.start),
                    "delta");
    if (solved.stop_reason == StopReason::MaxSteps)
        solution.report.remarks.warn("not steady after " + std::to_string(solved.steps) +
                                         " steps: the last change was " + number(solved.last_change) +
                                         " voxels; increase `max_steps` to continue until the surface is steady",
                                     problem.run);
}

}  // namespace covol::pipeline
