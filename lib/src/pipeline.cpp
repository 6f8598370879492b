// segment(): the steps in their order. Each is a module of pipeline/, and works on one Job.
#include "covol/pipeline.h"
#include "covol/error.h"

#include <openvdb/openvdb.h>

#include <optional>
#include <utility>

#include "pipeline/automatic.h"
#include "pipeline/coarse_level.h"
#include "pipeline/doubts.h"
#include "pipeline/fields.h"
#include "pipeline/final_surface.h"
#include "pipeline/flow.h"
#include "pipeline/starts.h"

namespace covol {
namespace {

using namespace pipeline;

// A surface that vanished, or that left the marks, is not returned while the marks alone tell of one.
/// @param start  the body between contours; null: the start was another one
void fall_back(Job& job, const FloatGridPtr& start) {
    const bool vanished = has_vanished(job);
    if (vanished && start != nullptr) {
        job.result.u = start;
        job.report().solve.stop_reason = StopReason::NotRun;
        return job.warn("the flow from the body between the contours lost it: this is that body itself");
    }
    if (!job.guided() || job.origin == StartOrigin::Guess || job.sure.size() < 4 || !job.uses_points()) return;
    if (!vanished && (job.origin == StartOrigin::Contours || !misses_marks(job, *job.result.u))) return;
    const FloatGridPtr before = job.result.u;
    try {
        start_from_guess(job);
    } catch (const Error& error) {
        if (error.code() == Errc::Cancelled) throw;
        job.result.u = before;
        return;
    }
    if (!vanished && misses_marks(job, *job.result.u)) {
        job.result.u = before;
        return;
    }
    job.warn(std::string("the surface ") + (vanished ? "vanished" : "left more than a tenth of the marks") +
             ": this is the one through the marks that bends least instead; the image had no say in it");
    flow(job);
}

void solve(Job& job, const std::optional<FineStart>& without_coarse) {
    const FloatGridPtr start = job.guided() && job.origin == StartOrigin::Contours ? job.result.u->deepCopy() : nullptr;
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

void run_steps(Job& job) {
    Timed total(job.report().seconds.total);
    check_input(job);
    choose_values(job);
    if (job.options.guess) {
        start_from_corrected_guess(job);
        choose_edge_feature(job);
        find_edges(job);
        return make_surface(job);
    }
    make_start(job);  // distance and band
    choose_edge_feature(job);
    const std::optional<FineStart> without_coarse = pass_coarse_levels(job);
    find_edges(job);
    compute_sure_distance(job);
    solve(job, without_coarse);
    make_surface(job);
}

}  // namespace

SegmentResult segment(const Image* image, const std::vector<Vec3>& world_points, const SegmentOptions& options,
                      const RunContext& run) {
    SegmentResult result;
    with_threads(run, [&] {
        Job job(image, world_points, options, run);
        run_steps(job);
        job.report().resolved = job.options;
        result = std::move(job.result);
    });
    return result;
}

}  // namespace covol
