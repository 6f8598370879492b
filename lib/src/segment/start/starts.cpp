#include "segment/start/starts.h"

#include <utility>

#include "base/heuristics.h"
#include "start/carry_on.h"

namespace covol::pipeline {

StartSurface follow(StartOrigin origin, const Choices& choices, MarkSets marks) {
    StartSurface start;
    start.facts.origin = origin;
    start.facts.marks = std::move(marks);
    start.facts.flow = choices.evolve;
    start.facts.flow.follow = true;
    return start;
}

Domain choose_domain_of_flow(const Problem& problem, double h, const std::vector<Vec3>& points) {
    const Domain domain = problem.domain(h, points, 2 * kBeyondVoxels * h);
    return problem.is_turned() && !problem.options.roi ? widened(domain, int(kBeyondVoxels)) : domain;
}

FloatGridPtr carried_beyond_turned_image(const Problem& problem, const Domain& domain, FloatGridPtr u) {
    if (!problem.is_turned()) return u;
    const FloatGridPtr whole = detail::carried_beyond(*u, domain, make_clip(problem.image->geometry()), problem.run);
    return whole ? whole : u;
}

StartSurface make_start(const Problem& problem, const Choices& choices, MarkSets marks) {
    switch (choices.start) {
        case StartMethod::Corrected: return start_from_corrected_guess(problem, choices, std::move(marks));
        case StartMethod::Seeds: return start_from_seeds(problem, choices, std::move(marks));
        case StartMethod::Guess: return start_from_guess(problem, choices, std::move(marks));
        case StartMethod::Cloud: return start_from_cloud(problem, choices, std::move(marks));
        case StartMethod::Named: return start_as_named(problem, choices, std::move(marks));
        case StartMethod::Tagged: break;
    }
    return start_from_contours_or_tags(problem, choices, std::move(marks));
}

}  // namespace covol::pipeline
