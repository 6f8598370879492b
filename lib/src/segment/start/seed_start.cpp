// The start from seeds alone; the image decides from there.
#include "segment/heuristics.h"
#include "segment/start/starts.h"

namespace covol::pipeline {

void start_from_seeds(Job& job) {
    job.origin = StartOrigin::Given;
    job.options.evolve.follow = true;
    job.report().domain = job.domain_with_chosen_margin(2 * kJob.margin_voxels * job.h());
    {
        Timed timed(job.report().seconds.tag);
        job.result.u = covol::start_from_seeds(job.domain(), job.options.inside, job.options.outside, job.run);
    }
    job.choose("start", "seeds",
               job.options.outside.empty()
                   ? "there are no marks, and no seeds outside: a little around the seeds inside"
                   : "there are no marks: halfway between seeds inside and outside");
    if (job.options.outside.empty()) grow_to_edges(job);
}

}  // namespace covol::pipeline
