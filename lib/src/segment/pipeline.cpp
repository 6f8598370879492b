// segment(): the steps in their order. Each is a module beside this file or in start/, and works on one Job.
#include "covol/pipeline.h"
#include "covol/error.h"

#include <openvdb/openvdb.h>

#include <optional>
#include <utility>

#include "segment/automatic.h"
#include "segment/coarse_level.h"
#include "segment/doubts.h"
#include "segment/fields.h"
#include "segment/final_surface.h"
#include "segment/flow.h"
#include "segment/start/starts.h"

namespace covol {
namespace {

using namespace pipeline;

/// Where the flow came to.
struct FlowEnd {
    FloatGridPtr u;
    StartOrigin origin;
    Domain domain;
};

void take_back(Job& job, const FlowEnd& end) {
    job.result.u = end.u;
    job.origin = end.origin;
    job.report().domain = end.domain;
    job.report().guess = {};
    job.report().automatic.erase("guess");
}

// A surface that vanished, or that left the marks, is not returned while the start or the marks tell of one.
/// @param start  null: it was not good by itself
void fall_back(Job& job, const FloatGridPtr& start) {
    const bool vanished = has_vanished(job);
    if (start != nullptr && has_lost(job, *start)) {
        job.result.u = start;
        job.report().solve = {};
        if (job.origin == StartOrigin::Grown)
            return job.warn("the flow closed what had grown to the image's edges: this is that start itself");
        job.options.edge.feature = EdgeFeature::Slope;
        job.choose("edge_feature", to_string(EdgeFeature::Slope),
                   "along lines the surface left the marks: the body between them rests instead");
        return flow(job);
    }
    if (!job.guided() || job.rests() || job.trusted.size() < 4 || !job.uses_points()) return;
    if (!vanished && (job.origin == StartOrigin::Contours || !misses_marks(job, *job.result.u))) return;
    const FlowEnd before{job.result.u, job.origin, job.domain()};
    bool better = false;
    try {
        start_from_guess(job);
        better = vanished || !misses_marks(job, *job.result.u);
    } catch (const Error& error) {
        if (error.code() == Errc::Cancelled) throw;
        job.run.info(std::string("no guess instead: ") + error.what());
    }
    if (!better) return take_back(job, before);
    job.warn(std::string("the surface ") + (vanished ? "vanished" : "left more than a tenth of the marks") +
             ": this is the one through the marks that bends least instead");
    flow(job);
}

void solve(Job& job, const std::optional<FineStart>& without_coarse) {
    const bool is_good = job.origin == StartOrigin::Grown || (job.guided() && job.follows_lines());
    const FloatGridPtr start = is_good ? job.result.u->deepCopy() : nullptr;
    flow(job);
    if (without_coarse && has_vanished(job)) {
        leave_out_coarse_level(job, *without_coarse);
        find_edges(job);
        flow(job);
    }
    fall_back(job, start);
    job.run.check();
    job.result.u->setName("u");
    check_flow(job);
}

void run_steps(Job& job, FloatGridPtr& start) {
    Timed total(job.report().seconds.total);
    check_input(job);
    choose_values(job);
    if (!job.cloud) doubt_isolated_marks(job);
    make_start(job);  // distance and band
    choose_edge_feature(job);
    const std::optional<FineStart> without_coarse = pass_coarse_levels(job);
    find_edges(job);
    compute_trusted_distance(job);
    if (job.options.keep_failed) start = job.result.u->deepCopy();
    solve(job, without_coarse);
    require_outside(job);
    make_surface(job);
}

SegmentResult run_job(const Image* image, const std::vector<Vec3>& world_points, const SegmentOptions& options,
                      const RunContext& run) {
    SegmentResult result;
    with_threads(run, [&] {
        Job job(image, world_points, options, run);
        FloatGridPtr start;
        try {
            run_steps(job, start);
        } catch (const Error& error) {
            if (!options.keep_failed || !job.result.u) throw;
            throw SegmentFailed(error, start ? start : job.result.u, job.result);
        }
        job.report().resolved = job.options;
        result = std::move(job.result);
    });
    return result;
}

}  // namespace

SegmentResult segment(const Image& image, const std::vector<Vec3>& world_points, const SegmentOptions& options,
                      const RunContext& run) {
    return run_job(&image, world_points, options, run);
}

SegmentResult segment(const Image& image, const SegmentOptions& options, const RunContext& run) {
    return run_job(&image, {}, options, run);
}

SegmentResult reconstruct(const std::vector<Vec3>& world_points, const SegmentOptions& options, const RunContext& run) {
    return run_job(nullptr, world_points, options, run);
}

}  // namespace covol
