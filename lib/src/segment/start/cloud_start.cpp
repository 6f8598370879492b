// The start from a cloud: the surface itself.
#include <openvdb/openvdb.h>

#include <cmath>

#include "cloud/surface/cloud_field.h"
#include "covol/start.h"
#include "distance/memory_need.h"
#include "segment/fields.h"
#include "segment/heuristics.h"
#include "segment/start/starts.h"

namespace covol::pipeline {
namespace {

// Where a scan has no points its surface rests on nothing, and would slide along the walls that have some.
FloatGridPtr raised(const FloatGrid& start, double depth) {
    FloatGridPtr obstacle = start.deepCopy();
    for (auto leaf = obstacle->tree().beginLeaf(); leaf; ++leaf)
        for (auto value = leaf->beginValueAll(); value; ++value) value.setValue(float(*value + depth));
    return obstacle;
}

void tell_of_hints(Job& job, const HintsReport& hints) {
    if (hints.normals + hints.sensors == 0) return;
    const bool normals = hints.normals > 0 && !hints.from_sensor;
    if (!hints.used)
        return job.warn(std::string(normals ? "the normals" : "the sensor") + " of the points' file not used: " +
                        (hints.why_not.empty() ? "most points have none" : hints.why_not));
    job.choose("normals", normals ? "as given" : "by the sensor",
               number(std::round(1000 * hints.agree) / 10) + " % agree with the result" +
                   (hints.inward ? ", after all were turned over, for they pointed inwards" : ""));
    if (1 - hints.agree > kStarts.warn_disagreeing)
        job.warn(number(std::round(1000 * (1 - hints.agree)) / 10) + " % of the normals that are " +
                 (normals ? "given" : "made by the sensor") + " point to the wrong side");
}

}  // namespace

void choose_cloud_domain(Job& job) {
    job.report().domain = job.domain_with_chosen_margin(kStarts.margin_share * longest_side(bounding_box(job.points)) +
                                                        kJob.margin_voxels * job.h());
}

void make_start_of_field(Job& job) {
    if (!job.rests_on_field()) job.result.u = start_from_grid(job.domain(), *job.result.u, job.run);
}

void start_from_cloud(Job& job) {
    job.origin = StartOrigin::Cloud;
    job.options.evolve.follow = true;
    choose_cloud_domain(job);
    CloudReport& report = job.report().cloud;
    {
        Timed timed(job.report().seconds.tag);
        job.result.u = cloud::settled_field(job.domain(), *job.cloud, report, job.run);
        make_start_of_field(job);
    }
    if (!job.rests() && job.uses_points()) {
        if (job.has_automatic_range) {
            const double range = kStarts.reach_spacings * std::max(report.spacing, job.h());
            job.options.evolve.attraction_range = range;
            job.choose("attraction_range", number(range),
                       "the start touches the points, and where there are none nothing should pull");
        }
        if (!report.encloses) job.obstacle = raised(*job.result.u, kFlow.hold_depth * job.h());
        find_distance(job, tube_for_start(job));
    }
    const std::string how = report.encloses ? "; averaged within " + number(report.radius)
                                            : "; they enclose nothing: inside is what they hide";
    job.choose("start", "cloud",
               std::to_string(job.points.size()) + " points, " + number(report.spacing) + " apart, noise " +
                   number(report.noise) + how);
    tell_of_hints(job, report.hints);
    if (report.stray > 0)
        job.choose("stray_points", std::to_string(report.stray), "far from all others and on no sheet: left out");
    if (report.layered > 0)
        job.choose("layered_points", std::to_string(report.layered),
                   "of layers below others, as of scans that do not quite fit: not passed");
    if (report.dropped_pieces > 0)
        job.run.info("cloud: " + std::to_string(report.dropped_pieces) +
                     " pieces of the surface that hardly a point rested on left out");
    if (report.joined_pieces > 0)
        job.run.info("cloud: " + std::to_string(report.joined_pieces) +
                     " small pieces of the surface joined to what is nearest, points lie between");
    if (report.held_voxels > 0)
        job.run.info("cloud: its handles and pieces are those of the points' indicator function, which has fewer; " +
                     std::to_string(report.held_voxels) + " voxels held");
}

}  // namespace covol::pipeline
