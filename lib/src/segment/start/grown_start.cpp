// Grows a start inside an object to the object's edges if there are no points, so that only the image attracts.
#include "segment/heuristics.h"
#include "segment/start/starts.h"
#include "start/grow.h"

namespace covol::pipeline {

// Without growth, curvature would make a start that has no edges nearby vanish before it reaches any.
void grow_to_edges(const Problem& problem, const Choices& choices, StartSurface& start) {
    StartFacts& facts = start.facts;
    if (!problem.is_guided() || !uses_image(facts.flow) || uses_points(facts.flow)) return;
    const RunContext& run = problem.run;
    Remarks& remarks = facts.report.remarks;
    const Timed timed(facts.report.seconds.tag);
    const detail::GrownStart grown =
        detail::grow_to_edges(*problem.image, *start.u, choices.edge.sigma.value_or(choices.h), run);
    if (!grown.level_set) return remarks.choose("growth", "none", grown.why, run);
    remarks.choose("growth", "to edges", grown.why, run);
    facts.origin = StartOrigin::Grown;
    start.u = grown.level_set;
    if (problem.options.evolve.delta) return;
    const double delta = kStarts.grown_delta_voxels * choices.h;
    facts.flow.delta = delta;
    remarks.choose("delta", number(delta), number(kStarts.grown_delta_voxels) + " voxels: the start lies at the edges",
                   run);
}

}  // namespace covol::pipeline
