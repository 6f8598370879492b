// The start from few marks: the surface of minimum bending energy through them.
#include <utility>

#include "base/heuristics.h"
#include "contours/section_field.h"
#include "covol/inference.h"
#include "covol/orientation.h"
#include "covol/start.h"
#include "distance/memory_need.h"
#include "grid/levels_at.h"
#include "guess/guess_in_image.h"
#include "segment/solve/fields.h"
#include "segment/start/starts.h"

namespace covol::pipeline {
namespace {

/// Standard deviations of a mark's position as vectors along three axes: the option mark_precision, else for positions
/// rounded to the image's voxels, or without an image to voxels of size h.
std::array<Vec3, 3> deviation(const Problem& problem, double h) {
    std::array<Vec3, 3> axes{};
    for (int a = 0; a < 3; ++a) {
        const std::optional<double>& given = problem.options.mark_precision;
        if (problem.image == nullptr || given) {
            axes[a][a] = given.value_or(kUniformDeviation * h);
            continue;
        }
        const ImageGeometry& geometry = problem.image->geometry();
        for (int row = 0; row < 3; ++row)
            axes[a][row] = kUniformDeviation * geometry.spacing[a] * geometry.direction[row][a];
    }
    return axes;
}

GuessOptions guess_options(const Problem& problem, double h, const std::vector<Vec3>& marks) {
    const SegmentOptions& requested = problem.options;
    GuessOptions options;
    options.deviation = deviation(problem, h);
    if (problem.image == nullptr && !requested.mark_precision)
        options.max_deviation = measure_cloud_scale(marks, problem.run).noise;
    options.inside = requested.inside;
    options.outside = requested.outside;
    options.outside.insert(options.outside.end(), requested.exterior_seeds.begin(), requested.exterior_seeds.end());
    // Only normals that are known to point outwards are used: others from a file may have any direction.
    if (requested.hints.is_outward && requested.hints.normals.size() == marks.size())
        options.normals = requested.hints.normals;
    return options;
}

/// Estimate of the surface's area: the total area of three sides of the box, about the area of a ball that fills it.
double largest_area(const WorldBox& box) {
    double area = 0;
    for (int a = 0; a < 3; ++a) {
        const double u = box.max[(a + 1) % 3] - box.min[(a + 1) % 3], v = box.max[(a + 2) % 3] - box.min[(a + 2) % 3];
        area += u * v;
    }
    return area;
}

/// Number of seeds that lie on the wrong side of the surface.
std::size_t count_wrong(const Problem& problem, const FloatGrid& u) {
    std::size_t wrong = 0;
    for (const double level : detail::levels_at(u, problem.options.inside)) wrong += level >= 0;
    for (const double level : detail::levels_at(u, problem.options.outside)) wrong += level < 0;
    return wrong;
}

/// Replaces the guess by the interpolation between the sections of a network of contours, if that has fewer seeds on
/// the wrong side:
/// the surface of minimum bending energy may diverge between thin parts, the interpolation does not.
void take_sections(const Problem& problem, const std::vector<Vec3>& marks, StartSurface& start) {
    StartFacts& facts = start.facts;
    const std::size_t before = count_wrong(problem, *start.u);
    if (before == 0) return;
    const Domain& domain = facts.domain;
    const detail::SectionField field(problem.options.sections->planes, domain.voxel_size, domain.origin, problem.run);
    const FloatGridPtr u = start_from_level(
        domain, marks,
        [&](const Vec3& from, const Vec3& step, int n, double* values) { field.row(from, step, n, values); },
        problem.run);
    const std::size_t after = count_wrong(problem, *u);
    if (after >= before) return;
    start.u = u;
    facts.on_surface = marks;
    facts.guess.summary =
        std::to_string(marks.size()) + " marks; " + std::to_string(before) +
        " positions in their sections contradict the surface of minimum bending energy through them: the "
        "harmonic function between the sections is used";
    facts.guess.wrong_seeds = after;
}

void guess(const Problem& problem, const std::vector<Vec3>& marks, StartSurface& start) {
    StartFacts& facts = start.facts;
    Guess made = guess::guess_in_image(facts.domain, marks, guess_options(problem, start.h(), marks), problem.clip(),
                                       problem.run);
    facts.guess = std::move(made.report);
    start.u = std::move(made.u);
    facts.on_surface = std::move(made.marks);
    if (problem.options.sections) take_sections(problem, marks, start);
}

/// Replaces the guess by the body inferred from marks and image together, unless the marks alone are as good.
void infer_start(const Problem& problem, StartSurface& start) {
    StartFacts& facts = start.facts;
    KnownSides sides{problem.options.inside, problem.options.outside};
    sides.outside.insert(sides.outside.end(), problem.options.exterior_seeds.begin(),
                         problem.options.exterior_seeds.end());
    Inferred inferred = infer(*start.u, facts.on_surface, *problem.image, sides, problem.run);
    facts.inference = std::move(inferred.report);
    if (facts.inference.wrong_marks.empty() || facts.inference.used) {
        start.u = std::move(inferred.u);
        facts.on_surface = std::move(inferred.marks);
    } else {
        guess(problem, inferred.marks, start);
    }
}

}  // namespace

StartSurface start_from_guess(const Problem& problem, const Choices& choices, MarkSets marks) {
    const RunContext& run = problem.run;
    const double h = choices.h;
    StartSurface start = follow(StartOrigin::Guess, choices, std::move(marks));
    StartFacts& facts = start.facts;
    const std::vector<Vec3>& points = facts.marks.attracting;
    const WorldBox box = bounding_box(points);
    facts.domain = problem.domain(h, points, kCommon.margin * longest_side(box) + kBeyondVoxels * h);
    // A body that the image cuts is continued beyond the image and clipped later: if it ended at the image's end, it
    // would be closed by a cap there, and the image would be evaluated at that cap.
    if (problem.image != nullptr && !problem.options.roi) facts.domain = widened(facts.domain, int(kBeyondVoxels));
    detail::require_band_memory(largest_area(box), h, "segment", run);
    {
        const Timed timed(facts.report.seconds.tag);
        guess(problem, points, start);
        if (problem.image != nullptr && uses_image(facts.flow)) infer_start(problem, start);
    }
    if (!is_final_start(problem, facts, EdgeFeature::Slope))
        start.distance = find_distance_for_flow(facts, *start.u, facts.report, run);
    facts.report.remarks.choose("guess", facts.guess.summary, "", run);
    return start;
}

}  // namespace covol::pipeline
