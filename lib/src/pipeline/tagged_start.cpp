// The start from the points alone.
#include <openvdb/openvdb.h>

#include <algorithm>

#include "covol/scan_solid.h"
#include "pipeline/fields.h"
#include "pipeline/starts.h"

namespace covol::pipeline {
namespace {

constexpr double kCloseFromVoxels = 5.0;  // a tag distance beyond this starts from the closing instead
constexpr double kSolidReach = 3.0;       // voxels of the solid's own grid that its start may lie off the points

std::vector<Vec3> all_seeds(const Job& job) {
    std::vector<Vec3> seeds = job.options.exterior_seeds;
    seeds.insert(seeds.end(), job.hole_seeds.begin(), job.hole_seeds.end());
    seeds.insert(seeds.end(), job.options.outside.begin(), job.options.outside.end());
    return seeds;
}

/// Holes narrower than D are no exterior, and seeds outside may lie as close to the border as they like; a seed of the
/// exterior that the user gave is band()'s to judge.
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
    const WorldBox box = bounding_box(job.points);
    double extent = 0;
    for (int a = 0; a < 3; ++a) extent = std::max(extent, box.max[a] - box.min[a]);
    const Domain wide = job.domain_with_margin(0.25 * extent + kMarginVoxels * job.h());
    job.report().tag = choose_tag_distance(job.points, wide, all_seeds(job), job.run);
    job.options.tag_distance = job.report().tag.tag_distance;
    job.choose("tag_distance", number(job.options.tag_distance), job.report().tag.reason);
}

// Nothing is enclosed at any D, as where one side was seen only: the surface of a solid that carries the points.
bool start_from_solid(Job& job) {
    Timed timed(job.report().seconds.tag);
    const ScanSolid solid = solid_from_scan(job.points, job.h(), job.run);
    if (!solid.level_set) return false;
    double& range = job.options.evolve.attraction_range;
    if (job.has_automatic_range && job.uses_points()) {
        range = kSolidReach * solid.voxel_size;
        job.choose("attraction_range", number(range),
                   "the start touches the points, and where there are none nothing should pull");
    }
    job.report().domain = job.domain_with_chosen_margin(range + kMarginVoxels * job.h());
    job.result.u = start_from_grid(job.domain(), *solid.level_set, job.run);
    job.hold = job.result.u->deepCopy();
    job.options.evolve.follow = true;
    job.choose("start", "solid",
               "the points enclose nothing; a ball of radius " + number(solid.ball_radius) +
                   " rolled around them leaves a solid behind " + number(100 * solid.carried) + " % of them, with " +
                   std::to_string(solid.carved) + " of its hollows opened again");
    if (job.uses_points()) compute_distance(job, tube_for_start(job));
    return true;
}

// The tagged surface lies D outside the points, as far as the widest gap is large. Its closing by a ball of radius D
// touches them, needs a band of a few voxels instead of {d <= D + 3h}, and leaves the flow a short way.
void start_from_closing(Job& job, double D) {
    FloatGridPtr closed = closing(*job.result.u, D, job.run);
    if (!closed) return;
    job.result.u = closed;
    job.options.evolve.follow = true;
    job.choose("start", "closing",
               "of the tagged surface by a ball of radius D, for D is wider than " + number(kCloseFromVoxels) +
                   " voxels");
}

}  // namespace

void start_by_tagging(Job& job) {
    job.origin = StartOrigin::Tagged;
    const bool is_automatic = job.options.tag_distance <= 0;
    if (is_automatic) choose_tag(job);
    if (job.image == nullptr && is_automatic && !job.report().tag.encloses && start_from_solid(job)) return;
    const double D = job.options.tag_distance;
    job.report().domain = job.domain_with_chosen_margin(D + kMarginVoxels * job.h());
    compute_distance(job, D + band_slack(job), D);
    Timed timed(job.report().seconds.tag);
    BandResult tagged = band(*job.result.distance, {D, seeds_beyond(job, D)}, job.run);
    job.report().band = tagged.report;
    job.result.u = tagged.grid;
    if (tagged.report.leaks) job.run.warn(tagged.report.leak());
    if (D > kCloseFromVoxels * job.h()) start_from_closing(job, D);
    job.report().tag.tag_distance = D;
}

}  // namespace covol::pipeline
