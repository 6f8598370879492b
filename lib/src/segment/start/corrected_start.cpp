// The result of another tool, corrected by marks and seeds.
#include <openvdb/openvdb.h>

#include <algorithm>
#include <utility>

#include "base/heuristics.h"
#include "covol/inference.h"
#include "segment/doubts.h"
#include "segment/heuristics.h"
#include "segment/start/starts.h"

namespace covol::pipeline {
namespace {

CorrectionOptions correction_options(const Problem& problem, double h) {
    CorrectionOptions options = problem.options.correction;
    if (options.min_radius) return options;
    double minimum = kCorrectionVoxels * h;
    if (problem.image != nullptr) {
        const Vec3& spacing = problem.image->geometry().spacing;
        // The radius is at least twice the largest spacing, so that a mark also affects the neighbouring slices.
        minimum = std::max(minimum, 2 * *std::max_element(spacing.begin(), spacing.end()));
    }
    options.min_radius = minimum;
    return options;
}

/// Redraws start.u by the image, if the image is used, and then corrects it by the marks and seeds.
GuessCorrection correct(const Problem& problem, const std::vector<Vec3>& marks, StartSurface& start) {
    const RunContext& run = problem.run;
    const Timed timed(start.facts.report.seconds.tag);
    start.facts.correction_options = correction_options(problem, start.h());
    RedrawnGuess redrawn;
    if (problem.image != nullptr && uses_image(start.facts.flow)) {
        const Redrawn by_image =
            redraw(start.u, marks, *problem.image, {problem.options.inside, problem.options.outside}, run);
        start.facts.report.remarks.choose("redrawn", by_image.used ? "by the image" : "no", by_image.reason, run);
        redrawn = by_image;
    }
    GuessCorrection made = correct_guess(start.u, marks, problem.options.inside, problem.options.outside,
                                         start.facts.correction_options, run, redrawn);
    const CorrectionReport& report = start.facts.correction_report = made.report();
    if (report.before_max > kDoubts.far_from_guess * report.depth)
        start.facts.report.remarks.warn(
            "a mark lies " + number(report.before_max) +
                " from the guess, whose largest inscribed ball has a radius of " + number(report.depth) +
                ": at that distance the guess contains little information, and its correction may be worse than the "
                "guess itself; add marks there, or start from the marks alone",
            run);
    start.u = made.start(run);
    return made;
}

std::string distances(const CorrectionReport& report) {
    return "distance of the marks from the surface: mean " + number(report.before_mean) + ", max " +
           number(report.before_max) + ", after correction " + number(report.after_mean) + ", " +
           number(report.after_max);
}

}  // namespace

void correct_start(const Problem& problem, StartSurface& start) {
    const GuessCorrection made = correct(problem, start.facts.marks.trusted, start);
    start.facts.report.remarks.choose("correction", "of the start", distances(made.report()), problem.run);
}

StartSurface start_from_corrected_guess(const Problem& problem, const Choices& choices, MarkSets marks) {
    StartSurface start;
    StartFacts& facts = start.facts;
    facts.origin = StartOrigin::Corrected;
    facts.marks = std::move(marks);
    facts.flow = choices.evolve;
    facts.domain = problem.domain(choices.h, facts.marks.attracting, 2 * kBeyondVoxels * choices.h);
    {
        const Timed timed(facts.report.seconds.tag);
        start.u = start_grid(*problem.options.guess, facts.domain, problem.run);
    }
    facts.border_inside = inside_on_border(problem, *start.u);
    facts.correction = std::make_shared<const GuessCorrection>(
        correct(problem, problem.options.contours ? facts.marks.trusted : facts.marks.attracting, start));
    const CorrectionReport& report = facts.correction_report;
    facts.report.remarks.choose("start", "guess",
                                "corrected within " + number(report.min_radius) + " to " +
                                    number(report.largest_radius) + " of " + std::to_string(report.marks) +
                                    " marks and " + std::to_string(report.seeds) +
                                    " seeds that were on the wrong side; " + distances(report),
                                problem.run);
    return start;
}

}  // namespace covol::pipeline
