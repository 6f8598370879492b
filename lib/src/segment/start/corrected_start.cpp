// Another tool's result, corrected by marks and seeds.
#include <openvdb/openvdb.h>

#include <algorithm>

#include "segment/doubts.h"
#include "segment/heuristics.h"
#include "segment/start/starts.h"

namespace covol::pipeline {
namespace {

CorrectionOptions correction(const Job& job) {
    CorrectionOptions options = job.options.correction;
    if (options.least_radius) return options;
    double least = kCorrectionVoxels * job.h();
    if (job.image != nullptr) {
        const Vec3& spacing = job.image->geometry().spacing;
        least = std::max(least, kStarts.radius_spacings * *std::max_element(spacing.begin(), spacing.end()));
    }
    options.least_radius = least;
    return options;
}

GuessCorrection corrected(Job& job, const FloatGridPtr& guess, const std::vector<Vec3>& marks) {
    GuessCorrection made =
        correct_guess(guess, marks, job.options.inside, job.options.outside, correction(job), job.run);
    const CorrectionReport& report = made.report();
    if (report.before_max > kDoubts.far_from_guess * report.depth)
        job.warn("a mark lies " + number(report.before_max) +
                 " from the guess, whose largest ball inside has a radius of " + number(report.depth) +
                 ": so far from it the guess says little, and its correction may be worse than the guess itself; mark "
                 "more there, or begin from the marks alone");
    return made;
}

std::string distances(const CorrectionReport& report) {
    return "from the marks to it: mean " + number(report.before_mean) + ", max " + number(report.before_max) +
           ", corrected " + number(report.after_mean) + ", " + number(report.after_max);
}

}  // namespace

void correct_start(Job& job) {
    Timed timed(job.report().seconds.tag);
    const GuessCorrection correction = corrected(job, job.result.u, job.trusted);
    job.result.u = correction.start(job.run);
    job.report().correction = correction.report();
    job.choose("correction", "of the start", distances(correction.report()));
}

void start_from_corrected_guess(Job& job) {
    job.origin = StartOrigin::Corrected;
    job.report().domain = job.domain_with_chosen_margin(2 * kJob.margin_voxels * job.h());
    Timed timed(job.report().seconds.tag);
    job.options.correction = correction(job);
    const FloatGridPtr guess = job.result.u = start_grid(*job.options.guess, job.domain(), job.run);
    note_border(job);
    job.result.correction =
        std::make_shared<const GuessCorrection>(corrected(job, guess, job.options.contours ? job.trusted : job.points));
    job.result.u = job.result.correction->start(job.run);
    const CorrectionReport& report = job.report().correction = job.result.correction->report();
    job.choose("start", "guess",
               "corrected within " + number(report.least_radius) + " to " + number(report.largest_radius) + " of " +
                   std::to_string(report.marks) + " marks and " + std::to_string(report.seeds) +
                   " seeds that it had on the wrong side; " + distances(report));
}

}  // namespace covol::pipeline
