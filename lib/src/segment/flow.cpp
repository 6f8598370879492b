#include "segment/flow.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>

#include "covol/error.h"
#include "segment/doubts.h"
#include "segment/fields.h"
#include "segment/heuristics.h"
#include "segment/vanished.h"

namespace covol::pipeline {
namespace {

/// What the steps before cost goes to the total; the rest of it stays the later steps'.
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

// Edges of other structures lie between the tagged surface and the points: with an image the points pull alone first.
EvolveReport approach(Job& job, EvolveFields fields) {
    if (job.origin != StartOrigin::Tagged || !job.uses_points() || !job.uses_image()) return {};
    EvolveOptions alone = job.options.evolve;
    alone.rho = 0;
    alone.attraction_range = 0;
    alone.image_yields = 0;
    if (alone.follow) alone.tau = kFlow.approach_tau * alone.tau.value_or(job.h());
    alone.max_steps = std::min(alone.max_steps, kFlow.approach_steps);
    alone.tolerance = std::max(alone.tolerance, kFlow.approach_tolerance);
    fields.edge = nullptr;
    fields.extend = nullptr;
    return evolve(*job.result.u, fields, alone, job.run);
}

EvolveReport approach_and_evolve(Job& job, const EvolveFields& fields) {
    const EvolveReport before = approach(job, fields);
    if (before.stop_reason == StopReason::Vanished) return before;
    EvolveReport solved = evolve(*job.result.u, fields, job.options.evolve, job.run);
    add(before, solved);
    return solved;
}

/// Of places to the zero level set; in its band, so clamped.
double mean_distance(const std::vector<Vec3>& places, const FloatGrid& u) {
    double sum = 0;
    for (const double level : levels_at(u, places)) sum += std::abs(level);
    return sum / double(places.size());
}

double inside_volume(const FloatGrid& u) {
    double voxels = 0;
    for (auto value = u.tree().cbeginValueAll(); value; ++value)
        if (*value < 0) voxels += double(value.getVoxelCount());
    return voxels * std::pow(u.voxelSize()[0], 3);
}

std::string why_vanished(const Job& job) {
    const SegmentReport& report = job.result.report;
    if (job.tags() && job.origin != StartOrigin::Contours) {
        const bool encloses = report.tag.reason.empty() ? !report.band.leaks : report.tag.encloses;
        if (job.image == nullptr)
            return detail::why_nothing_held(job.points, job.options.tag_distance.value_or(0), encloses);
        if (!encloses)
            return "the points enclose nothing and nothing held it; where the structure is cut off by the image's end "
                   "mark the cut too, or give a `tag_distance` beyond its radius; or draw `contours`, or choose "
                   "another start (`start`)";
    }
    return "nothing held it; lower `delta`, or start closer to the edges (`start`)";
}

// A surface through the marks is moved to where the image shows, between them, what it shows at them.
void ask_image(Job& job) {
    if (!job.uses_image() || job.origin == StartOrigin::Corrected) return;
    const std::vector<Vec3>& marks = job.origin == StartOrigin::Guess ? job.on_surface : job.trusted;
    GuidanceOptions options;
    if (job.options.mark_precision) options.mark_precision = *job.options.mark_precision / kUniformDeviation;
    options.weight = job.options.evolve.rho;
    // The image may not say how wrong the body between contours is: where it shows another border, it says very.
    if (job.origin == StartOrigin::Contours && job.options.contours->slice_distance > 0)
        options.range = kFlow.contour_range * job.options.contours->slice_distance;
    GuidanceReport& report = job.report().guidance;
    job.result.u = guide(*job.result.u, marks, *job.image, options, report, job.run);
    job.choose("image", report.used ? "used" : "not used", report.reason);
}

void rest(Job& job) {
    EvolveReport& report = job.report().solve;
    report.stop_reason = StopReason::Steady;
    report.active_voxels = std::int64_t(job.result.u->activeVoxelCount());
    report.leaf_count = std::int64_t(job.result.u->tree().leafCount());
}

}  // namespace

void flow(Job& job) {
    if (job.rests()) {
        Timed timed(job.report().seconds.solve);
        ask_image(job);
        rest(job);
        job.report().active_voxels = job.report().solve.active_voxels;
        job.report().leaf_count = job.report().solve.leaf_count;
        return;
    }
    EvolveFields fields;
    fields.distance = job.uses_points() ? job.result.distance.get() : nullptr;
    fields.edge = job.result.edge.get();
    fields.trusted = job.trusted_distance.get();
    fields.obstacle = job.obstacle.get();
    fields.floor = job.floor.get();
    if (job.options.evolve.follow)
        fields.extend = [&job](const FloatGrid& u, EvolveFields& f) { extend_edges(job, u, f); };
    fields.take_edge = [&job](const FloatGridPtr& edge, EvolveFields& f) {
        job.result.edge = edge;
        f.edge = edge.get();
    };
    SegmentReport& report = job.report();
    {
        Timed timed(report.seconds.solve);
        const double edge_before = report.seconds.edge;
        report.solve = approach_and_evolve(job, fields);
        report.seconds.solve -= report.seconds.edge - edge_before;
    }
    report.active_voxels = report.solve.active_voxels;
    report.leaf_count = report.solve.leaf_count;
}

bool has_vanished(const Job& job) { return job.result.report.solve.stop_reason == StopReason::Vanished; }

bool has_lost(const Job& job, const FloatGrid& start) {
    if (has_vanished(job)) return true;
    if (job.origin == StartOrigin::Grown)
        return inside_volume(*job.result.u) < kFlow.least_of_grown * inside_volume(start);
    return mean_distance(job.trusted, *job.result.u) >
           mean_distance(job.trusted, start) + kFlow.leaves_voxels * job.h();
}

void check_flow(Job& job) {
    const EvolveReport& solved = job.result.report.solve;
    if (has_vanished(job))
        throw Error(Errc::InvalidInput, "segment: the surface vanished after " + std::to_string(solved.steps) +
                                            " steps: " + why_vanished(job));
    if (solved.stop_reason == StopReason::MaxSteps)
        job.warn("not steady after " + std::to_string(solved.steps) + " steps: the last change was " +
                 number(solved.last_change) + " voxels");
}

}  // namespace covol::pipeline
