// A start inside an object grows to the object's edges where the image alone decides.
#include "segment/heuristics.h"
#include "segment/start/starts.h"
#include "start/grow.h"

namespace covol::pipeline {

// Where nothing is near, curvature would close the start before it meets an edge.
void grow_to_edges(Job& job) {
    if (!job.guided() || !job.uses_image() || job.uses_points()) return;
    Timed timed(job.report().seconds.tag);
    const detail::GrownStart grown =
        detail::grow_to_edges(*job.image, *job.result.u, job.options.edge.sigma.value_or(job.h()), job.run);
    if (!grown.level_set) return job.choose("growth", "none", grown.why);
    job.choose("growth", "to edges", grown.why);
    job.origin = StartOrigin::Grown;
    job.result.u = grown.level_set;
    if (!job.report().automatic.contains("delta")) return;
    const double delta = kStarts.grown_delta_voxels * job.h();
    job.options.evolve.delta = delta;
    job.choose("delta", number(delta), number(kStarts.grown_delta_voxels) + " voxels: the start lies at the edges");
}

}  // namespace covol::pipeline
