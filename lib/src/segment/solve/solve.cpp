#include "segment/solve/solve.h"

#include <openvdb/openvdb.h>

#include <optional>
#include <utility>

#include "base/heuristics.h"
#include "covol/error.h"
#include "segment/doubts.h"
#include "segment/heuristics.h"
#include "segment/solve/coarse_level.h"
#include "segment/start/starts.h"

namespace covol::pipeline {
namespace {

Solution flow_by_levels(const Problem& problem, StartSurface start, const EdgeOptions& edge, Reached* reached) {
    CoarsePass coarse = pass_coarse_levels(problem, start, edge);
    Solution solution;
    if (coarse.u) {
        solution = flow(problem, from_coarse_level(start, coarse.u), edge, reached);
        if (solution.has_vanished()) {
            coarse.reports.back().why_not = "the surface vanished on the finer level";
            problem.run.info("coarse level left out: the surface vanished on the finer level");
            solution = flow(problem, std::move(start), edge, reached);
        }
    } else {
        solution = flow(problem, std::move(start), edge, reached);
    }
    solution.coarse = std::move(coarse.reports);
    solution.coarse_levels = coarse.levels;
    solution.report.add(coarse.report);
    return solution;
}

/// The solution `later` with the remarks, times and coarse levels of the solution `earlier` that it replaces, and with
/// the fields of `earlier` that it lacks.
Solution after(const Solution& earlier, Solution later) {
    StepReport report = earlier.report;
    report.add(later.report);
    later.report = report;
    later.coarse = earlier.coarse;
    later.coarse_levels = earlier.coarse_levels;
    if (!later.edges.grid) later.edges = earlier.edges;
    if (!later.distance) later.distance = earlier.distance;
    return later;
}

/// The replacement for a flow that made a usable start worse (has_lost()): a grown start itself, or the flow from the
/// body between contours with slopes instead of lines as edges.
/// @param u  the level set of the start
Solution start_instead(const Problem& problem, const Solution& lost, const FloatGridPtr& u, Reached* reached) {
    if (lost.start.origin == StartOrigin::Grown) {
        Solution kept = lost;
        kept.u = u;
        kept.solve = steady_report(*u);
        kept.solve.stop_reason = StopReason::NotRun;
        kept.report.remarks.warn(
            "the flow lost the start that was grown to the image's edges: the result is that start itself",
            problem.run);
        return kept;
    }
    EdgeOptions edge = lost.edges.options;
    edge.feature = EdgeFeature::Slope;
    StepReport report;
    report.remarks.choose("edge_feature", to_string(edge.feature),
                          "with lines as edges the surface was lost: the body between the contours is kept instead",
                          problem.run);
    Solution rested = flow(problem, {lost.start, u, lost.distance, nullptr, nullptr}, edge, reached);
    report.add(rested.report);
    rested.report = report;
    rested.edges = lost.edges;
    rested.edges.options = edge;
    return after(lost, std::move(rested));
}

/// The guess through the marks; none if it cannot be computed, or if the flow's surface did not vanish and the guess
/// also misses the marks. The time that such a guess took is added to the report of the solution.
std::optional<StartSurface> find_better_guess(const Problem& problem, const Choices& choices, Solution& solution) {
    try {
        StartSurface guess = start_from_guess(problem, choices, solution.start.marks);
        if (solution.has_vanished() || !misses_marks(problem, guess.facts, *guess.u)) return guess;
        solution.report.add({.remarks = {}, .seconds = guess.facts.report.seconds});
        return {};
    } catch (const Error& error) {
        if (error.code() != Errc::InvalidInput) throw;
        problem.run.info(std::string("no guess as a replacement: ") + error.what());
        return {};
    }
}

Solution guess_instead(const Problem& problem, const Choices& choices, Solution solution, Reached* reached) {
    const StartFacts& facts = solution.start;
    const bool vanished = solution.has_vanished();
    if (!problem.is_guided() || !uses_points(facts.flow) || facts.marks.trusted.size() < 4 ||
        is_final_start(problem, facts, solution.edges.options.feature))
        return solution;
    if (!vanished && (facts.origin == StartOrigin::Contours || !misses_marks(problem, facts, *solution.u)))
        return solution;
    std::optional<StartSurface> guess = find_better_guess(problem, choices, solution);
    if (!guess) return solution;
    guess->facts.tag = facts.tag;
    guess->facts.tag_distance = facts.tag_distance;
    guess->facts.band = facts.band;
    StepReport report = facts.report;
    report.add(guess->facts.report);
    guess->facts.report = report;
    solution.report.remarks.warn(
        std::string("the surface ") +
            (vanished ? "vanished" : "left more than " + number(100 * kCommon.minority) + " % of the marks") +
            ": the result is the surface of minimum bending energy through the marks instead",
        problem.run);
    Solution guessed = flow(problem, std::move(*guess), solution.edges.options, reached);
    return after(solution, std::move(guessed));
}

}  // namespace

Solution solve(const Problem& problem, const Choices& choices, StartSurface start, const EdgeOptions& edge,
               Reached* reached) {
    const StartOrigin origin = start.facts.origin;
    const bool is_good = origin == StartOrigin::Grown || (origin == StartOrigin::Contours && problem.is_guided() &&
                                                          uses_image(start.facts.flow) && is_line(edge.feature));
    const FloatGridPtr kept = is_good ? start.u->deepCopy() : nullptr;
    Solution solution = flow_by_levels(problem, std::move(start), edge, reached);
    solution = kept && has_lost(solution, *kept) ? start_instead(problem, solution, kept, reached)
                                                 : guess_instead(problem, choices, std::move(solution), reached);
    problem.run.check();
    solution.u->setName("u");
    check_flow(problem, choices, solution);
    return solution;
}

}  // namespace covol::pipeline
