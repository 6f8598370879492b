// The start from seeds alone. There are no marks, so that only the image moves the surface from there.
#include <utility>

#include "covol/start.h"
#include "segment/start/starts.h"

namespace covol::pipeline {

StartSurface start_from_seeds(const Problem& problem, const Choices& choices, MarkSets marks) {
    const SegmentOptions& options = problem.options;
    StartSurface start = follow(StartOrigin::Given, choices, std::move(marks));
    StartFacts& facts = start.facts;
    facts.domain = choose_domain_of_flow(problem, choices.h, facts.marks.attracting);
    {
        const Timed timed(facts.report.seconds.tag);
        start.u = covol::start_from_seeds(facts.domain, options.inside, options.outside, problem.run);
    }
    facts.report.remarks.choose("start", "seeds",
                                options.outside.empty()
                                    ? "there are no marks, and no seeds outside: a small region around the seeds inside"
                                    : "there are no marks: halfway between seeds inside and outside",
                                problem.run);
    if (options.outside.empty()) grow_to_edges(problem, choices, start);
    start.u = carried_beyond_turned_image(problem, facts.domain, start.u);
    return start;
}

}  // namespace covol::pipeline
