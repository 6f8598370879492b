// segment(): the sequence of steps. Each is a function of values, in a module of this folder or its subfolders.
#include "covol/pipeline.h"

#include <openvdb/openvdb.h>

#include <utility>

#include "segment/doubts.h"
#include "segment/result/report.h"
#include "segment/solve/solve.h"
#include "segment/start/starts.h"

namespace covol {
namespace {

using namespace pipeline;

SegmentResult run_steps(const Problem& problem, Reached* reached) {
    Resolved resolved = resolve(problem);
    const Choices& choices = resolved.choices;
    StepReport before = choices.report;
    if (!choices.cloud) before.remarks.add(doubt_isolated_marks(problem));
    StartSurface start = make_start(problem, choices, std::move(resolved.marks));  // with the distance to the points
    const EdgeChoice edge = choose_edge_feature(problem, choices);
    before.add(edge.report);
    if (reached != nullptr) *reached = {start.u->deepCopy(), start.u, start.distance, nullptr};
    Solution solution = solve(problem, choices, std::move(start), edge.options, reached);
    require_outside(problem, *solution.u, solution.start.border_inside);
    Surface surface = make_surface(problem, choices, solution);
    SegmentReport report = measure(problem, choices, before, solution, surface);
    return {std::move(surface.u),
            std::move(solution.distance),
            std::move(solution.edges.grid),
            std::move(surface.level_set),
            std::move(surface.mesh),
            std::move(surface.distance_to_points),
            std::move(solution.start.correction),
            std::move(report)};
}

SegmentResult run(const Image* image, const std::vector<Vec3>& world_points, const SegmentOptions& options,
                  const RunContext& context) {
    SegmentResult result;
    with_threads(context, [&] {
        double seconds = 0;
        Reached reached;
        try {
            const Timed total(seconds);
            result =
                run_steps(Problem(image, world_points, options, context), options.keep_failed ? &reached : nullptr);
        } catch (const Error& error) {
            if (!reached.u) throw;
            throw SegmentFailed(error, reached.start, reached.u, reached.distance, reached.edge);
        }
        result.report.seconds.total = seconds;
    });
    return result;
}

}  // namespace

SegmentResult segment(const Image& image, const std::vector<Vec3>& world_points, const SegmentOptions& options,
                      const RunContext& context) {
    return run(&image, world_points, options, context);
}

SegmentResult segment(const Image& image, const SegmentOptions& options, const RunContext& context) {
    return run(&image, {}, options, context);
}

SegmentResult reconstruct(const std::vector<Vec3>& world_points, const SegmentOptions& options,
                          const RunContext& context) {
    return run(nullptr, world_points, options, context);
}

}  // namespace covol
