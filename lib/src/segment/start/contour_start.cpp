// The start from the body between contours.
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/heuristics.h"
#include "covol/error.h"
#include "covol/start.h"
#include "segment/solve/fields.h"
#include "segment/start/starts.h"

namespace covol::pipeline {
namespace {

/// Extends the domain on the sides where the body extends beyond it: if the body ended at the image's end, the flow
/// would bend its surface until it is perpendicular to that end.
Domain carried_beyond_image(Domain domain, const WorldBox& body) {
    const WorldBox box = domain.world_box();
    const int layers = int(kBeyondVoxels);
    for (int a = 0; a < 3; ++a) {
        if (body.min[a] < box.min[a]) domain.min[a] -= layers;
        if (body.max[a] > box.max[a]) domain.max[a] += layers;
    }
    return domain;
}

/// The trusted marks that do not belong to contours.
std::vector<Vec3> loose_points(const MarkSets& marks, const Contours& contours) {
    const auto loose = std::ptrdiff_t(marks.trusted.size() - contours.along.size());
    return {marks.trusted.begin(), marks.trusted.begin() + loose};
}

/// The reason for tagging the points instead of starting from the body between the contours; null if there is none.
const char* why_tag(const Problem& problem, const std::vector<Vec3>& loose, double h) {
    const ContourSolid& body = *problem.body();
    for (const Vec3& seed : problem.options.exterior_seeds)
        if (body.level(seed) < 0) return "an exterior seed lies inside the contours";
    // Maximum plausible error of the body: the attraction range, or the distance between slices if that is larger.
    const double far =
        std::max(kAttractionVoxels * h, problem.is_guided() ? problem.options.contours->slice_distance : 0.0);
    for (const Vec3& point : loose)
        if (std::abs(body.level(point)) > far) return "points lie far from the contours' body";
    return nullptr;
}

}  // namespace

StartSurface start_from_contours_or_tags(const Problem& problem, const Choices& choices, MarkSets marks) {
    const ContourSolid* body = problem.body();
    if (body == nullptr) return start_by_tagging(problem, choices, std::move(marks), {});
    const RunContext& run = problem.run;
    const std::vector<Vec3> loose = loose_points(marks, *problem.options.contours);
    if (const char* objection = why_tag(problem, loose, choices.h)) {
        StepReport report;
        report.remarks.choose("start", "tag", objection, run);
        StartSurface tagged = start_by_tagging(problem, choices, std::move(marks), body->hole_seeds());
        report.add(tagged.facts.report);
        tagged.facts.report = report;
        return tagged;
    }
    if (problem.options.contours->flat && loose.empty())
        throw Error(Errc::InvalidInput,
                    "segment: all contours lie on one slice, so the thickness of the body is unknown; mark a "
                    "second slice, or give `contour_thickness`",
                    "contour_thickness");
    StartSurface start = follow(StartOrigin::Contours, choices, std::move(marks));
    StartFacts& facts = start.facts;
    facts.report.remarks.choose("start", "contours",
                                "the body between the contours; what inner contours enclose is outside", run);
    facts.domain = problem.domain(choices.h, facts.marks.attracting, 2 * kBeyondVoxels * choices.h);
    if (!problem.options.roi) facts.domain = carried_beyond_image(facts.domain, body->box());
    {
        const Timed timed(facts.report.seconds.tag);
        start.u = start_from_contours(facts.domain, *body, run);
    }
    if (!uses_points(facts.flow)) return start;
    if (problem.is_guided() && !loose.empty()) correct_start(problem, start);
    const double range = std::max(facts.flow.attraction_range.value_or(0), kBeyondVoxels * choices.h);
    start.distance =
        find_distance(facts.marks.attracting, facts.domain, range + band_slack(choices.h), 0, facts.report, run);
    return start;
}

}  // namespace covol::pipeline
