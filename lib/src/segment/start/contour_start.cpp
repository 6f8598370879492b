// The start from the body between contours.
#include <algorithm>
#include <cmath>

#include "covol/error.h"
#include "segment/automatic.h"
#include "segment/fields.h"
#include "segment/heuristics.h"
#include "segment/start/starts.h"

namespace covol::pipeline {
namespace {

/// A body that goes on beyond the image is followed a little there: at the image's end itself the flow would turn its
/// wall to a right angle.
void carry_beyond_image(Job& job) {
    Domain& domain = job.report().domain;
    const WorldBox body = job.body()->box(), box = domain.world_box();
    const int layers = int(kJob.margin_voxels);
    for (int a = 0; a < 3; ++a) {
        if (body.min[a] < box.min[a]) domain.min[a] -= layers;
        if (body.max[a] > box.max[a]) domain.max[a] += layers;
    }
}

/// Those of the trusted marks that are no contours'.
std::vector<Vec3> loose_points(const Job& job) {
    const auto loose = std::ptrdiff_t(job.trusted.size() - job.options.contours->along.size());
    return {job.trusted.begin(), job.trusted.begin() + loose};
}

/// Why the points are tagged after all, or null.
const char* why_tag(const Job& job, const std::vector<Vec3>& loose) {
    for (const Vec3& seed : job.options.exterior_seeds)
        if (job.body()->level(seed) < 0) return "an exterior seed lies inside the contours";
    // Between slices, and beyond the last, the body may be that wrong.
    const double far =
        std::max(kAutomatic.tag_attraction_voxels * job.h(), job.guided() ? job.options.contours->slice_distance : 0.0);
    for (const Vec3& point : loose)
        if (std::abs(job.body()->level(point)) > far) return "points lie far from the contours' body";
    return nullptr;
}

}  // namespace

bool start_from_contours(Job& job) {
    if (job.body() == nullptr || !job.tags()) return false;
    const std::vector<Vec3> loose = loose_points(job);
    if (const char* reason = why_tag(job, loose)) {
        job.choose("start", "tag", reason);
        job.hole_seeds = job.body()->hole_seeds();
        return false;
    }
    if (job.options.contours->flat && loose.empty())
        throw Error(Errc::InvalidInput,
                    "segment: all contours lie on one slice, which tells nothing of how thick the body is; mark a "
                    "second slice, or give its `thickness`");
    job.choose("start", "contours", "the body between the contours; what inner contours enclose is outside");
    job.origin = StartOrigin::Contours;
    job.options.evolve.follow = true;
    job.report().domain = job.domain_with_chosen_margin(2 * kJob.margin_voxels * job.h());
    if (!job.options.roi) carry_beyond_image(job);
    {
        Timed timed(job.report().seconds.tag);
        job.result.u = covol::start_from_contours(job.domain(), *job.body(), job.run);
    }
    if (job.guided() && job.uses_points() && !loose.empty()) correct_start(job);
    if (job.uses_points())
        find_distance(job, std::max(job.attraction_range(), kJob.margin_voxels * job.h()) + band_slack(job));
    return true;
}

}  // namespace covol::pipeline
