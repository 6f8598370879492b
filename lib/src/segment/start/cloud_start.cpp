// The start from a cloud, which is the surface itself.
#include <openvdb/openvdb.h>

#include <cmath>
#include <utility>

#include "cloud/surface/cloud_field.h"
#include "covol/start.h"
#include "segment/heuristics.h"
#include "segment/solve/fields.h"
#include "segment/start/starts.h"

namespace covol::pipeline {
namespace {

// In the holes of a scan nothing holds the surface, which would slide along the adjoining walls.
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
        return remarks.warn(std::string(normals ? "the normals" : "the sensor") + " of the points' file not used: " +
                                (hints.why_not.empty() ? "most points have none" : hints.why_not),
                            run);
    remarks.choose("normals", normals ? "as given" : "by the sensor",
                   number(std::round(1000 * hints.agree) / 10) + " % agree with the result" +
                       (hints.inward ? ", after all were turned over, for they pointed inwards" : ""),
                   run);
    if (1 - hints.agree > kStarts.warn_disagreeing)
        remarks.warn(number(std::round(1000 * (1 - hints.agree)) / 10) + " % of the normals that are " +
                         (normals ? "given" : "made by the sensor") + " point to the wrong side",
                     run);
}

void report_cloud(const CloudReport& report, std::size_t points, Remarks& remarks, const RunContext& run) {
    const std::string how = report.fills      ? "; they fill a solid: it ends where their density is half of its median"
                            : report.encloses ? "; averaged within " + number(report.radius)
                                              : "; they enclose nothing: inside is what they hide";
    remarks.choose(
        "start", "cloud",
        std::to_string(points) + " points, " + number(report.spacing) + " apart, noise " + number(report.noise) + how,
        run);
    if (report.fills)
        remarks.warn(
            "the points fill a solid, they do not lie on a surface: the surface is where their density falls "
            "to half of its median; if they do lie on one, there are too few of them for their noise",
            run);
    report_hints(report.hints, remarks, run);
    if (report.stray > 0)
        remarks.choose("stray_points", std::to_string(report.stray), "far from all others and on no sheet: left out",
                       run);
    if (report.enclosed > 0)
        remarks.choose("enclosed_points", std::to_string(report.enclosed),
                       "inside on both sides by the normals, as where walls touch or cross: left out", run);
    if (report.layered > 0)
        remarks.choose("layered_points", std::to_string(report.layered),
                       "of layers below others, as of scans that do not quite fit: not passed", run);
    if (report.dropped_pieces > 0)
        run.info("cloud: " + std::to_string(report.dropped_pieces) +
                 " pieces of the surface that hardly a point rested on left out");
    if (report.joined_pieces > 0)
        run.info("cloud: " + std::to_string(report.joined_pieces) +
                 " small pieces of the surface joined to what is nearest, points lie between");
    if (report.held_voxels > 0)
        run.info("cloud: its handles and pieces are those of the points' indicator function, which has fewer; " +
                 std::to_string(report.held_voxels) + " voxels held");
}

}  // namespace

Domain choose_cloud_domain(const Problem& problem, double h, const std::vector<Vec3>& points) {
    return problem.domain(h, points,
                          kStarts.margin_fraction * longest_side(bounding_box(points)) + kJob.margin_voxels * h);
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
            const double range = kStarts.reach_spacings * std::max(report.spacing, choices.h);
            facts.flow.attraction_range = range;
            remarks.choose("attraction_range", number(range),
                           "the start touches the points, and where there are none nothing should pull", run);
        }
        if (!report.encloses) start.obstacle = raised(*start.u, kFlow.hold_depth * choices.h);
        start.distance = find_distance_for_flow(facts, *start.u, facts.report, run);
    }
    report_cloud(report, facts.marks.attracting.size(), remarks, run);
    return start;
}

}  // namespace covol::pipeline
