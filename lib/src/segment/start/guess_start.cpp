// The start from few marks: the surface through them that bends least.
#include "covol/orientation.h"
#include "distance/memory_need.h"
#include "guess/guess_in_image.h"
#include "segment/fields.h"
#include "segment/heuristics.h"
#include "segment/start/starts.h"

namespace covol::pipeline {
namespace {

/// How well marks are placed, along the image's axes; without an image, of what the voxel size says.
std::array<Vec3, 3> deviation(const Job& job) {
    std::array<Vec3, 3> axes{};
    for (int a = 0; a < 3; ++a) {
        const std::optional<double>& given = job.options.mark_precision;
        if (job.image == nullptr || given) {
            axes[a][a] = given.value_or(kUniformDeviation * job.h());
            continue;
        }
        const ImageGeometry& geometry = job.image->geometry();
        for (int row = 0; row < 3; ++row)
            axes[a][row] = kUniformDeviation * geometry.spacing[a] * geometry.direction[row][a];
    }
    return axes;
}

}  // namespace

void start_from_guess(Job& job) {
    job.origin = StartOrigin::Guess;
    job.options.evolve.follow = true;
    const WorldBox box = bounding_box(job.points);
    job.report().domain =
        job.domain_with_chosen_margin(kStarts.guess_margin * longest_side(box) + kJob.margin_voxels * job.h());
    double area = 0;  // of a ball of that size, at most
    for (int a = 0; a < 3; ++a) {
        const double u = box.max[(a + 1) % 3] - box.min[(a + 1) % 3], v = box.max[(a + 2) % 3] - box.min[(a + 2) % 3];
        area += u * v;
    }
    detail::require_band_memory(area, job.h(), "segment", job.run);
    GuessOptions options;
    options.deviation = deviation(job);
    if (job.image == nullptr && !job.options.mark_precision)
        options.most_deviation = measure_cloud_scale(job.points, job.run).noise;
    options.inside = job.options.inside;
    options.outside = job.options.outside;
    options.outside.insert(options.outside.end(), job.options.exterior_seeds.begin(), job.options.exterior_seeds.end());
    // A body that the image cuts goes on beyond it: at the image's end itself its wall would be closed, and the image
    // asked about a cap. The clip at the end makes the cut.
    if (job.image != nullptr && !job.options.roi)
        job.report().domain = widened(job.domain(), kStarts.guess_beyond_voxels);
    {
        Timed timed(job.report().seconds.tag);
        Guess guess =
            guess::guess_in_image(job.domain(), job.points, options, job.where_it_ends(), job.report().guess, job.run);
        job.result.u = std::move(guess.u);
        job.on_surface = std::move(guess.marks);
    }
    if (!job.rests() && job.uses_points()) find_distance(job, tube_for_start(job));
    job.choose("guess", job.report().guess.summary, "");
}

}  // namespace covol::pipeline
