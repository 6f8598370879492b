#include "segment/start/starts.h"

namespace covol::pipeline {

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
