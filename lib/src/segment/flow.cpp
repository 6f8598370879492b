#include "segment/flow.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>

#include "covol/error.h"
#include "segment/doubts.h"
#include "segment/fields.h"
#include "segment/vanished.h"

namespace covol::pipeline {
namespace {

constexpr double kApproachTau = 3.0;  // time steps of the points' own approach, in tau
constexpr int kApproachSteps = 40;
constexpr double kApproachTolerance = 0.01;
constexpr double kHoldDepth = 0.75;     // voxels that the surface may sink below a start that is held
constexpr double kLeastOfGrown = 0.5;   // of its volume: a flow that leaves less has lost the edges
constexpr double kLeavesVoxels = 0.25;  // farther from its marks than the start: what flowed has left them
constexpr int kHoldSteps = 2;
constexpr double kHoldTolerance = 0.01;  // voxels a step

/// What the steps before cost goes to the total; the rest of it stays the later steps'.
void add(const EvolveReport& before, EvolveReport& total) {
    const double sweeps = before.sweeps_per_step * before.steps + total.sweeps_per_step * total.steps;
    total.steps += before.steps;
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
    if (alone.follow) alone.tau = kApproachTau * alone.tau.value_or(job.h());
    alone.max_steps = std::min(alone.max_steps, kApproachSteps);
    alone.tolerance = std::max(alone.tolerance, kApproachTolerance);
    fields.edge = nullptr;
    fields.extend = nullptr;
    return evolve(*job.result.u, fields, alone, job.run);
}

void hold_up(FloatGrid& u, const FloatGrid& hold, double h) {
    const auto start = hold.getConstAccessor();
    const auto depth = static_cast<float>(kHoldDepth * h);
    for (auto leaf = u.tree().beginLeaf(); leaf; ++leaf)
        for (auto value = leaf->beginValueOn(); value; ++value)
            value.setValue(std::min(*value, start.getValue(value.getCoord()) + depth));
}

/// Of u, over the voxels beside the surface, voxels.
double mean_motion(const FloatGrid& before, const FloatGrid& after, double h) {
    const auto old = before.getConstAccessor();
    double sum = 0;
    std::int64_t count = 0;
    for (auto leaf = after.tree().cbeginLeaf(); leaf; ++leaf)
        for (auto value = leaf->cbeginValueOn(); value; ++value)
            if (std::abs(*value) < h) {
                sum += std::abs(*value - old.getValue(value.getCoord()));
                ++count;
            }
    return count > 0 ? sum / (double(count) * h) : 0.0;
}

// Where a scan has no points its surface rests on nothing, and would slide along the walls that have some: it may not
// sink deeper below the solid that it started from than a share of a voxel.
EvolveReport evolve_held(Job& job, const EvolveFields& fields) {
    FloatGrid& u = *job.result.u;
    EvolveReport total;
    EvolveOptions few = job.options.evolve;
    for (int left = few.max_steps; left > 0 && total.stop_reason != StopReason::Vanished; left -= kHoldSteps) {
        const FloatGridPtr before = u.deepCopy();
        few.max_steps = std::min(left, kHoldSteps);
        EvolveReport round = evolve(u, fields, few, job.run);
        hold_up(u, *job.hold, job.h());
        add(total, round);
        total = round;
        total.last_change = mean_motion(*before, u, job.h()) / few.max_steps;
        if (total.stop_reason != StopReason::Vanished && total.last_change < kHoldTolerance) {
            total.stop_reason = StopReason::Steady;
            break;
        }
    }
    return total;
}

EvolveReport approach_and_evolve(Job& job, const EvolveFields& fields) {
    const EvolveReport before = approach(job, fields);
    if (before.stop_reason == StopReason::Vanished) return before;
    EvolveReport solved =
        job.hold ? evolve_held(job, fields) : evolve(*job.result.u, fields, job.options.evolve, job.run);
    add(before, solved);
    return solved;
}

/// Of places to the zero level set; in its band, so clamped.
double mean_distance(const std::vector<Vec3>& places, const FloatGrid& u) {
    double sum = 0;
    for (const Vec3& place : places) sum += std::abs(level_at(u, place));
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
                   "mark the cut "
                   "too, or give a `tag_distance` beyond its radius; or draw `contours`, or choose another start "
                   "(`start`)";
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
    if (job.options.evolve.follow)
        fields.extend = [&job](const FloatGrid& u, EvolveFields& f) { extend_edges(job, u, f); };
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
    if (job.origin == StartOrigin::Grown) return inside_volume(*job.result.u) < kLeastOfGrown * inside_volume(start);
    return mean_distance(job.trusted, *job.result.u) > mean_distance(job.trusted, start) + kLeavesVoxels * job.h();
}

void check_flow(const Job& job) {
    const EvolveReport& solved = job.result.report.solve;
    if (has_vanished(job))
        throw Error(Errc::InvalidInput, "segment: the surface vanished after " + std::to_string(solved.steps) +
                                            " steps: " + why_vanished(job));
    if (solved.stop_reason == StopReason::MaxSteps)
        job.run.warn("not steady after " + std::to_string(solved.steps) + " steps: the last change was " +
                     number(solved.last_change) + " voxels");
}

}  // namespace covol::pipeline
