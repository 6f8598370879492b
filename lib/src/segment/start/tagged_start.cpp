// The start from the points alone.
#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "clip/open_ends.h"
#include "covol/distance.h"
#include "segment/fields.h"
#include "segment/heuristics.h"
#include "segment/start/starts.h"

namespace covol::pipeline {
namespace {

std::vector<Vec3> all_seeds(const Job& job) {
    std::vector<Vec3> seeds = job.options.exterior_seeds;
    seeds.insert(seeds.end(), job.hole_seeds.begin(), job.hole_seeds.end());
    seeds.insert(seeds.end(), job.options.outside.begin(), job.options.outside.end());
    return seeds;
}

/// Holes narrower than D are no exterior, and seeds outside may lie as close to the border as they like; a seed of the
/// exterior that the user gave is tag_interior()'s to judge.
std::vector<Vec3> seeds_beyond(const Job& job, double D) {
    std::vector<Vec3> seeds = job.options.exterior_seeds;
    const auto d_at = job.result.distance->getConstAccessor();
    std::vector<Vec3> others = job.hole_seeds;
    others.insert(others.end(), job.options.outside.begin(), job.options.outside.end());
    for (const Vec3& seed : others) {
        const Vec3 at = job.domain().world_to_index(seed);
        if (d_at.getValue(openvdb::Coord::round(openvdb::Vec3d(at[0], at[1], at[2]))) > D) seeds.push_back(seed);
    }
    return seeds;
}

void choose_tag(Job& job) {
    Timed timed(job.report().seconds.tag);
    // Wide enough for any D below a quarter of the cloud: the final domain is made once D is known.
    const Domain wide =
        job.domain_with_margin(0.25 * longest_side(bounding_box(job.points)) + kJob.margin_voxels * job.h());
    job.report().tag = choose_tag_distance(job.points, wide, all_seeds(job), job.run);
    job.options.tag_distance = job.report().tag.tag_distance;
    job.choose("tag_distance", number(job.report().tag.tag_distance), job.report().tag.reason);
}

// The tagged surface lies D outside the points, as far as the widest gap is large. Its closing by a ball of radius D
// touches them, needs a band of a few voxels instead of {d <= D + 3h}, and leaves the flow a short way.
void start_from_closing(Job& job, double D) {
    FloatGridPtr closed = close_by_ball(*job.result.u, D, job.run);
    if (!closed) return;
    job.result.u = closed;
    job.options.evolve.follow = true;
    job.choose("start", "closing",
               "of the tagged surface by a ball of radius D, for D is wider than " + number(kStarts.close_from_voxels) +
                   " voxels");
}

// ---- bodies that the image cuts off -------------------------------------------------------------------------------

/// On the same lattice, as large as all the points need, and some layers more.
Domain around(Domain domain, const std::vector<Vec3>& points, int layers) {
    const WorldBox box = bounding_box(points);
    const Vec3 low = domain.world_to_index(box.min), high = domain.world_to_index(box.max);
    for (int a = 0; a < 3; ++a) {
        domain.min[a] = std::min(domain.min[a], int(std::floor(low[a])));
        domain.max[a] = std::max(domain.max[a], int(std::ceil(high[a])));
    }
    return widened(domain, layers);
}

/// A tagged body that goes on beyond the image.
struct CutBody {
    std::vector<Vec3> beyond;  ///< the points that close it there
    FloatGridPtr level_set;    ///< on a domain wider than the image
    BandReport band;
    TagDistanceChoice tag;
};

/// @param beyond  points outside the image that close the cloud there
/// @return none where it encloses nothing all the same
std::optional<CutBody> tag_with(Job& job, const std::vector<Vec3>& beyond) {
    std::vector<Vec3> closed = job.points;
    closed.insert(closed.end(), beyond.begin(), beyond.end());
    const double h = job.h();
    CutBody body{.beyond = beyond, .level_set = nullptr, .band = {}, .tag = {}};
    if (job.options.tag_distance) {
        body.tag.tag_distance = *job.options.tag_distance;
    } else {
        body.tag = choose_tag_distance(
            closed, around(job.domain(), closed, 0.25 * longest_side(bounding_box(closed)) + kJob.margin_voxels * h),
            all_seeds(job), job.run);
        if (!body.tag.encloses) return {};
    }
    const double D = body.tag.tag_distance;
    const Domain wide = around(job.domain(), closed, D + kJob.margin_voxels * h);
    const FloatGridPtr d = compute_distance(closed, wide, {D + band_slack(job)}, job.run).grid;
    BandResult tagged = tag_interior(*d, {D, all_seeds(job)}, job.run);
    if (tagged.report.leaks) return {};
    body.band = tagged.report;
    body.level_set = close_by_ball(*tagged.grid, D, job.run);
    if (!body.level_set) body.level_set = tagged.grid;
    return body;
}

/// Whether the points, with the image's end as a hole wherever it cuts them, enclose a body all the same.
bool encloses_alone(const Job& job) {
    if (!job.options.tag_distance)
        return choose_tag_distance(job.points, job.domain(), all_seeds(job), job.run).encloses;
    const double D = *job.options.tag_distance;
    return !tag_interior(*compute_distance(job.points, job.domain(), {D + band_slack(job)}, job.run).grid,
                         {D, all_seeds(job)}, job.run)
                .report.leaks;
}

/// Marks within the section on an end slice, and those that carry them on, say that the body goes on there; a surface
/// they are not.
void drop_cap_marks(Job& job, const std::vector<detail::ImageFace>& faces) {
    const double deep = kStarts.cap_depth_voxels * job.h();
    const auto level = job.result.u->getConstAccessor();
    const auto caps = [&](const Vec3& p) {
        const Vec3 at = job.domain().world_to_index(p);
        return std::any_of(faces.begin(), faces.end(),
                           [&](const auto& face) { return face.depth(p) <= face.spacing; }) &&
               level.getValue(openvdb::Coord::round(openvdb::Vec3d(at[0], at[1], at[2]))) < -deep;
    };
    const auto dropped = std::count_if(job.marks.begin(), job.marks.end(), caps);
    std::erase_if(job.points, caps);
    std::erase_if(job.trusted, caps);
    if (dropped > 0)
        job.choose("cap_marks", std::to_string(dropped),
                   "marks within the section on the image's end slices close the body there and do not pull");
}

// The flood would come in through the cut, or stop between a face and a surface that leaves the image slowly.
bool start_from_cut_body(Job& job) {
    if (job.image == nullptr || job.options.roi) return false;
    const std::vector<detail::ImageFace> faces = detail::faces_of(job.image->geometry());
    const auto is_at_end = [&](const Vec3& p) {
        return std::any_of(faces.begin(), faces.end(), [&](const auto& f) { return detail::on_end_slice(f, p); });
    };
    const bool has_ends = std::any_of(job.points.begin(), job.points.end(), is_at_end);
    std::optional<CutBody> body;
    const char* how = "their section on the image's end slices goes on beyond it";
    {
        Timed timed(job.report().seconds.tag);
        job.report().domain = job.domain_with_chosen_margin(0);
        if (has_ends)
            body = tag_with(job, detail::carried_on(job.points, faces, kStarts.tagged_beyond_voxels * job.h()));
        if (!body) {
            how = "with their mirror image beyond the image's end they enclose a body";
            const std::vector<Vec3> images =
                detail::mirrored(job.points, faces, kStarts.mirror_spacings * measure_spacing(job.points).median);
            if (!images.empty() && !encloses_alone(job)) body = tag_with(job, images);
        }
        if (!body) return false;
        // At the image's end itself the flow would turn the wall to a right angle.
        job.report().domain = widened(job.domain(), kStarts.tagged_beyond_voxels);
        job.result.u = start_from_grid(job.domain(), *body->level_set, job.run);
        job.points.insert(job.points.end(), body->beyond.begin(), body->beyond.end());
        job.trusted.insert(job.trusted.end(), body->beyond.begin(), body->beyond.end());
    }
    job.choose("start", "cut body", how);
    if (!job.options.tag_distance) job.choose("tag_distance", number(body->tag.tag_distance), body->tag.reason);
    job.options.tag_distance = body->tag.tag_distance;
    job.report().tag = body->tag;
    job.report().band = body->band;
    job.options.evolve.follow = true;
    drop_cap_marks(job, faces);
    if (const double D = body->tag.tag_distance; job.uses_points()) find_distance(job, D + band_slack(job), D);
    return true;
}

}  // namespace

void start_by_tagging(Job& job) {
    job.origin = StartOrigin::Tagged;
    const bool is_automatic = !job.options.tag_distance;
    if (start_from_cut_body(job)) return;
    if (is_automatic) choose_tag(job);
    const double D = *job.options.tag_distance;
    job.report().domain = job.domain_with_chosen_margin(D + kJob.margin_voxels * job.h());
    find_distance(job, D + band_slack(job), D);
    Timed timed(job.report().seconds.tag);
    BandResult tagged = tag_interior(*job.result.distance, {D, seeds_beyond(job, D)}, job.run);
    job.report().band = tagged.report;
    job.result.u = tagged.grid;
    if (tagged.report.leaks) job.warn(tagged.report.leak());
    if (D > kStarts.close_from_voxels * job.h()) start_from_closing(job, D);
    job.report().tag.tag_distance = D;
}

}  // namespace covol::pipeline
