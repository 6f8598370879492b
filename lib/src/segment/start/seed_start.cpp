// The start from seeds alone; the image decides from there.
#include "segment/heuristics.h"
#include "segment/start/starts.h"

namespace covol::pipeline {

void start_from_seeds(Job& job) {
    job.origin = StartOrigin::Given;
    job.options.evolve.follow = true;
    choose_domain_of_flow(job);
    {
        Timed timed(job.report().seconds.tag);
        job.result.u = covol::start_from_seeds(job.domain(), job.options.inside, job.options.outside, job.run);
    }
    job.choose("start", "seeds",
               job.options.outside.empty()
                   ? "there are no marks, and no seeds outside: a little around the seeds inside"
                   : "there are no marks: halfway between seeds inside and outside");
    if (job.options.outside.empty()) grow_to_edges(job);
    carry_beyond_turned_image(job);
}

}  // namespace covol::pipeline
