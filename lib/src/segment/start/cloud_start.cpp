// The start from a cloud. In the guided model it is already the final surface, see is_final_start().
#include <openvdb/openvdb.h>

#include <cmath>
#include <utility>

#include "base/heuristics.h"
#include "cloud/surface/cloud_field.h"
#include "covol/start.h"
#include "holes/heuristics.h"
#include "segment/solve/fields.h"
#include "segment/start/starts.h"

namespace covol::pipeline {
namespace {

// The obstacle of the flow: the start moved inward by `depth`, inside which the surface must not move. In the holes of
// a scan no points hold the surface, which would otherwise slide along the adjoining walls.
FloatGridPtr raised(const FloatGrid& start, double depth) {
    FloatGridPtr obstacle = start.deepCopy();
    for (auto leaf = obstacle->tree().beginLeaf(); leaf; ++leaf)
        for (auto value = leaf->beginValueAll(); value; ++value) value.setValue(float(*value + depth));
    return obstacle;
}

void report_hints(const HintsReport& hints, Remarks& remarks, const RunContext& run) {
    if (hints.normals + hints.sensors == 0) return;
    const bool normals = hints.normals > 0 && !hints.from_sensor;
    if (!hints.used)
        return remarks.warn(std::string(normals ? "the normals" : "the sensor positions") +
                                " in the points' file are not used: " +
                                (hints.why_not.empty() ? "most points have none" : hints.why_not),
                            run);
    remarks.choose("normals", normals ? "as given" : "by the sensor",
                   number(std::round(1000 * hints.agree) / 10) + " % agree with the result" +
                       (hints.inward ? ", after all were flipped, because they pointed inwards" : ""),
                   run);
    if (1 - hints.agree > kCommon.minority)
        remarks.warn(number(std::round(1000 * (1 - hints.agree)) / 10) + " % of the " +
                         (normals ? "given normals" : "normals computed from the sensor positions") +
                         " point to the wrong side",
                     run);
}

void report_cloud(const CloudReport& report, std::size_t points, Remarks& remarks, const RunContext& run) {
    const std::string how = report.fills
                                ? "; they fill a solid: its surface is where their density falls to half of its median"
                            : report.encloses ? "; averaged within " + number(report.radius)
                                              : "; they enclose nothing: the region that they hide from view is inside";
    remarks.choose(
        "start", "cloud",
        std::to_string(points) + " points, " + number(report.spacing) + " apart, noise " + number(report.noise) + how,
        run);
    if (report.fills)
        remarks.warn(
            "the points fill a solid instead of lying on a surface: the result is where their density falls "
            "to half of its median; if they do lie on a surface, there are too few of them for their noise",
            run);
    report_hints(report.hints, remarks, run);
    if (report.stray > 0)
        remarks.choose("stray_points", std::to_string(report.stray), "far from all others and not on a sheet: left out",
                       run);
    if (report.enclosed > 0)
        remarks.choose("enclosed_points", std::to_string(report.enclosed),
                       "inside on both sides according to the normals, as at walls that touch or cross: left out", run);
    if (report.layered > 0)
        remarks.choose("layered_points", std::to_string(report.layered),
                       "in layers below others, as from scans that are not aligned exactly: the surface does not pass "
                       "through them",
                       run);
    if (report.dropped_pieces > 0)
        run.info("cloud: " + std::to_string(report.dropped_pieces) +
                 " pieces of the surface left out because hardly any points lie on them");
    if (report.joined_pieces > 0)
        run.info("cloud: " + std::to_string(report.joined_pieces) +
                 " small pieces of the surface joined to the nearest one, because points lie between them");
    if (report.held_voxels > 0)
        run.info("cloud: the surface has the handles and pieces of the points' indicator function, which are fewer; " +
                 std::to_string(report.held_voxels) + " voxels constrained");
}

}  // namespace

Domain choose_cloud_domain(const Problem& problem, double h, const std::vector<Vec3>& points) {
    return problem.domain(h, points, kCommon.margin * longest_side(bounding_box(points)) + kBeyondVoxels * h);
}

StartSurface start_from_cloud(const Problem& problem, const Choices& choices, MarkSets marks) {
    const RunContext& run = problem.run;
    StartSurface start = follow(StartOrigin::Cloud, choices, std::move(marks));
    StartFacts& facts = start.facts;
    Remarks& remarks = facts.report.remarks;
    facts.domain = choose_cloud_domain(problem, choices.h, facts.marks.attracting);
    const bool at_rest = is_final_start(problem, facts, EdgeFeature::Slope);
    {
        const Timed timed(facts.report.seconds.tag);
        CloudSurface field = cloud::settled_field(facts.domain, *choices.cloud, run);
        start.u = std::move(field.u);
        facts.cloud = std::move(field.report);
        facts.creases = std::move(field.creases);
        if (!at_rest) start.u = start_from_grid(facts.domain, *start.u, run);
    }
    const CloudReport& report = facts.cloud;
    if (!at_rest && uses_points(facts.flow)) {
        if (!problem.options.evolve.attraction_range) {
            const double range = kHoles.far * std::max(report.spacing, choices.h);
            facts.flow.attraction_range = range;
            remarks.choose("attraction_range", number(range),
                           "the start touches the points, and parts without points should not be attracted", run);
        }
        if (!report.encloses) start.obstacle = raised(*start.u, choices.h);
        start.distance = find_distance_for_flow(facts, *start.u, facts.report, run);
    }
    report_cloud(report, facts.marks.attracting.size(), remarks, run);
    return start;
}

}  // namespace covol::pipeline
