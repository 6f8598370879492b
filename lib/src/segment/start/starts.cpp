#include "segment/start/starts.h"

#include "segment/heuristics.h"
#include "start/carry_on.h"

namespace covol::pipeline {

void choose_domain_of_flow(Job& job) {
    Domain& domain = job.report().domain = job.domain_with_chosen_margin(2 * kJob.margin_voxels * job.h());
    if (job.is_turned() && !job.options.roi) domain = widened(domain, int(kJob.margin_voxels));
}

void carry_beyond_turned_image(Job& job) {
    if (!job.is_turned() || job.rests()) return;
    if (const FloatGridPtr whole =
            detail::carried_beyond(*job.result.u, job.domain(), make_clip(job.image->geometry()), job.run))
        job.result.u = whole;
}

void make_start(Job& job) {
    if (job.options.guess)
        start_from_corrected_guess(job);
    else if (job.has_seeds_alone())
        start_from_seeds(job);
    else if (job.guesses())
        start_from_guess(job);
    else if (job.is_cloud())
        start_from_cloud(job);
    else if (!job.tags())
        start_as_given(job);
    else if (!start_from_contours(job))
        start_by_tagging(job);
}

}  // namespace covol::pipeline
