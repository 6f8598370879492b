#include "segment/choices.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/heuristics.h"
#include "base/median.h"
#include "cloud/orientation/filled.h"
#include "covol/error.h"
#include "covol/scan_noise.h"
#include "points/heuristics.h"
#include "segment/heuristics.h"

namespace covol {
namespace pipeline {
namespace {

constexpr double kMaxReach = 1 << 22;  // [voxels] maximum distance from a lattice's origin, with some margin

/// Sets the weight of an input that is missing to 0: theta if there are no points, rho if there is no image.
EvolveOptions with_terms_that_act(const Problem& problem, bool has_points, Remarks& remarks) {
    EvolveOptions evolve = problem.options.evolve;
    if (!has_points && evolve.theta > 0) {
        evolve.theta = 0;
        remarks.choose("theta", "0", "there are no points", problem.run);
    }
    if (problem.image == nullptr && evolve.rho > 0) {
        evolve.rho = 0;
        remarks.choose("rho", "0", "there is no image", problem.run);
    }
    return evolve;
}

// A single outlier can make the domain larger than any lattice can hold. The error names the outlier.
void check_extent(const std::vector<Vec3>& points, double h) {
    if (points.size() < 8 || std::sqrt(3.0) * longest_side(bounding_box(points)) < kMaxReach * h) return;
    Vec3 middle{};
    for (int a = 0; a < 3; ++a) {
        std::vector<double> values;
        for (const Vec3& p : points) values.push_back(p[a]);
        middle[a] = cloud::median(std::move(values));
    }
    std::vector<double> away;
    for (const Vec3& p : points) away.push_back(std::hypot(p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]));
    const auto farthest = std::max_element(away.begin(), away.end()) - away.begin();
    const double far = away[std::size_t(farthest)];
    std::nth_element(away.begin(), away.begin() + std::ptrdiff_t(away.size() * 99 / 100), away.end());
    const double maximum = away[away.size() * 99 / 100];
    // The farthest point is no outlier if a lattice can hold it, or if even without it a lattice could hardly hold the
    // others, because the voxels are too small.
    if (far < kMaxReach * h || maximum >= kMaxReach / 2 * h) return;
    throw Error(Errc::InvalidInput, "points: " + detail::to_text(points[std::size_t(farthest)]) + " lies " +
                                        number(far) + " from the centre of all points, " + number(far / maximum) +
                                        " times as far as 99 % of them; remove it if it is a mistake, or use a larger "
                                        "`voxel_size`");
}

// Whether the points are treated as a cloud: without an image, if they do not lie in one plane, and are too many for
// the guess or fill a solid.
bool is_cloud(const Problem& problem, const EvolveOptions& evolve, const std::vector<Vec3>& points) {
    const SegmentOptions& o = problem.options;
    if (is_any<CloudStart>(o.start)) {
        if (problem.image == nullptr) return true;
        throw Error(
            Errc::InvalidOptions,
            "segment: `init = cloud` is for points without an image; leave the image out, or choose another start",
            "init");
    }
    return is_any<AutoStart>(o.start) && problem.is_guided() && !o.contours && !o.tag_distance &&
           !problem.has_seeds() && problem.image == nullptr && uses_points(evolve) && can_enclose(points) &&
           (points.size() > kAutomatic.max_guess_marks ||
            cloud::fill_a_solid(points, measure_spacing(points).median, problem.run));
}

// Chooses the guess for few marks: tagging would need marks whose spacing is everywhere much smaller than the thickness
// of the body.
StartMethod guess_or_tag(const Problem& problem, const std::vector<Vec3>& points, Remarks& remarks) {
    const SegmentOptions& o = problem.options;
    if (is_any<GuessStart>(o.start)) return StartMethod::Guess;
    if (is_any<TagStart>(o.start) || !problem.is_guided() || o.contours || o.tag_distance ||
        points.size() > kAutomatic.max_guess_marks)
        return StartMethod::Tagged;
    // These points cannot enclose a body. The error that refuse_flat() throws during tagging states what to add.
    if (problem.image == nullptr && !can_enclose(points)) return StartMethod::Tagged;
    remarks.choose("start", "guess",
                   std::to_string(points.size()) + " marks; with more than " +
                       std::to_string(kAutomatic.max_guess_marks) + ", there is no guess",
                   problem.run);
    return StartMethod::Guess;
}

std::vector<Vec3> merged(const std::vector<Vec3>& points, double h, const RunContext& run) {
    std::vector<Vec3> kept = merge_close_points(points, kAutomatic.noticeable_voxels * h);
    if (kept.size() < points.size())
        run.info("points: " + std::to_string(kept.size()) + " of " + std::to_string(points.size()) +
                 " kept; the others are closer to them than half of " + number(kAutomatic.noticeable_voxels * h));
    return kept;
}

// Replaces a thick layer of points, or several adjacent layers, by points on the surface in their middle.
std::vector<Vec3> without_noise(std::vector<Vec3> points, double h, Remarks& remarks, const RunContext& run) {
    const double radius = kScan.plane_voxels * h, thickness = measure_layer_thickness(points, radius, run);
    if (!(thickness > kAutomatic.noticeable_voxels * h)) return points;
    points = average_layers(points, radius, run);
    remarks.choose("points_averaged", "within " + number(radius),
                   "on average they lie " + number(thickness) + " from their local plane, more than " +
                       number(kAutomatic.noticeable_voxels) + " voxels",
                   run);
    return points;
}

double choose_attraction_range(const EvolveOptions& evolve, bool tags, double h, Remarks& remarks,
                               const RunContext& run) {
    if (!uses_points(evolve)) return 0;
    if (tags && !uses_image(evolve)) {
        remarks.choose("attraction_range", "0",
                       "unlimited, because the band around the points already limits the attraction", run);
        return 0;
    }
    const double range = kAttractionVoxels * h;
    remarks.choose(
        "attraction_range", number(range),
        number(kAttractionVoxels) + (tags ? " voxels: farther from the marks, the image decides" : " voxels"), run);
    return range;
}

/// Adds the lengths, times and weights of a flow.
Choices with_flow(const Problem& problem, Choices c) {
    const RunContext& run = problem.run;
    Remarks& remarks = c.report.remarks;
    const bool tags = c.start == StartMethod::Tagged, guesses = c.start == StartMethod::Guess;
    // Tagging and the guess start close to the result, so that a smaller weight of curvature is sufficient.
    const double delta_voxels = tags || guesses ? kAutomatic.tag_delta_voxels : 1.0;
    if (!c.evolve.delta) c.evolve.delta = delta_voxels * c.h;
    const bool is_final_start =
        (guesses || c.start == StartMethod::Cloud) && problem.is_guided() && uses_points(c.evolve);
    // There is no flow. `delta` is set nevertheless, because a later time frame may need it.
    if (is_final_start || c.start == StartMethod::Corrected) return c;
    if (!problem.options.evolve.delta)
        remarks.choose("delta", number(*c.evolve.delta), number(delta_voxels) + " voxels", run);
    c.evolve.solver_tolerance = c.evolve.solved_to();  // before coarse levels set `tau`, on which solved_to() depends
    if (!c.evolve.tau)
        remarks.choose("tau", number(c.h), "1 voxel at unit speed; longer while the surface moves slowly", run);
    if (!c.edge.sigma && uses_image(c.evolve)) {
        c.edge.sigma = c.h;
        remarks.choose("sigma", number(c.h), "1 voxel", run);
    }
    if (!c.evolve.attraction_range)
        c.evolve.attraction_range = choose_attraction_range(c.evolve, tags, c.h, remarks, run);
    if (!c.evolve.image_yields) {
        const bool yields = tags && uses_points(c.evolve) && uses_image(c.evolve);
        c.evolve.image_yields = yields ? 1.0 : 0.0;
        if (yields)
            remarks.choose("image_yields", "1", "near marks, the marks are more reliable than the image's edges", run);
    }
    return c;
}

/// Estimates the area of the indicator's surface from the cells that it crosses. A plane of the area of n cell faces
/// crosses 1.5 n cells, averaged over the directions of the plane.
double area_of(const Indicator& indicator) {
    double squares = 0;
    indicator.crossed([&](const WorldBox& box) {
        const double side = box.max[0] - box.min[0];
        squares += side * side;
    });
    return squares / 1.5;
}

}  // namespace

Resolved resolve(const Problem& problem) {
    const SegmentOptions& options = problem.options;
    const RunContext& run = problem.run;
    Choices c;
    Remarks& remarks = c.report.remarks;
    MarkSets marks = problem.marks();
    std::vector<Vec3>& points = marks.attracting;
    const bool has_points = !points.empty(), has_start = is_named(options.start) || options.guess;
    if (!has_points && !has_start && options.inside.empty())
        throw Error(Errc::InvalidInput,
                    "segment: expected points, contours, seeds inside or a start that needs none (`init`: sphere, box, "
                    "mesh, mask or vdb), got none of these");
    c.evolve = with_terms_that_act(problem, has_points, remarks);
    c.edge = options.edge;
    if (options.voxel_size) {
        c.h = *options.voxel_size;
    } else {
        const VoxelSizeChoice choice = problem.image != nullptr ? choose_voxel_size(*problem.image)
                                                                : choose_voxel_size(points, options.tags_points());
        c.h = choice.voxel_size;
        remarks.choose("voxel_size", number(c.h), choice.reason, run);
    }
    check_sides(options.inside, options.outside, kCommon.same_place * c.h);
    if (problem.image == nullptr) check_extent(points, c.h);
    if (options.guess) {
        c.start = StartMethod::Corrected;
    } else if (has_start) {
        c.start = StartMethod::Named;
    } else if (!has_points) {
        c.start = StartMethod::Seeds;
    } else if (is_cloud(problem, c.evolve, points)) {
        const Timed timed(c.report.seconds.tag);
        c.start = StartMethod::Cloud;
        c.cloud = orient_cloud(points, options.contours ? PointHints{} : options.hints, run);
        // Without quadrics (the cloud encloses nothing, or fills a solid) the surface is that of the indicator alone,
        // and the voxel size follows from the indicator's cells.
        const double h = c.cloud->has_quadrics ? 0 : kCommon.precision_voxels * c.cloud->orientation.screened->cell();
        if ((h > c.h || c.cloud->fills) && (!options.voxel_size || options.voxel_size_may_grow)) {
            c.h = h;
            remarks.choose("voxel_size", number(h), number(kCommon.precision_voxels) + " cells of the indicator", run);
        }
        // The surface that closes a scan may be much larger than the part on which the points lie. The voxel size is
        // therefore also limited by the area of the whole surface.
        const double area =
            area_of(c.cloud->orientation.screened ? *c.cloud->orientation.screened : *c.cloud->orientation.indicator);
        const double minimum = std::sqrt(area / (kAutomatic.max_facets * double(c.cloud->points.size())));
        if (minimum > c.h && (!options.voxel_size || options.voxel_size_may_grow)) {
            c.h = minimum;
            remarks.choose("voxel_size", number(minimum),
                           "with smaller voxels the surface would have more than " + number(kAutomatic.max_facets) +
                               " of them for each point",
                           run);
        }
    }
    points = merged(points, c.h, run);
    // Points enclosed by the surface, such as on walls within the body, are reported separately and not measured.
    const bool are_enclosed = c.cloud && c.cloud->enclosed > 0;
    c.measured_marks = options.contours ? problem.given : are_enclosed ? c.cloud->points : points;
    if (c.start == StartMethod::Tagged) c.start = guess_or_tag(problem, points, remarks);
    if (problem.image == nullptr && c.start == StartMethod::Tagged)
        points = without_noise(std::move(points), c.h, remarks, run);
    return {with_flow(problem, std::move(c)), std::move(marks)};
}

}  // namespace pipeline

VoxelSizeChoice choose_voxel_size(const Image& image) {
    return {image.geometry().smallest_spacing(), "the image's smallest spacing"};
}

VoxelSizeChoice choose_voxel_size(const std::vector<Vec3>& world_points, bool tagged) {
    using pipeline::number;
    const std::vector<Vec3> distinct = merge_close_points(world_points, 0);
    if (distinct.size() < 2)
        throw Error(Errc::InvalidInput,
                    "expected an image or at least 2 distinct points, got " + std::to_string(distinct.size()));
    const auto nearest = [](double spacing) {
        return VoxelSizeChoice{spacing, "the median distance between neighbouring points"};
    };
    const auto finer = [&](double spacing, double enough) {
        const double times = std::sqrt(double(distinct.size()) / enough);
        // If points lie densely on curves, a voxel size of their spacing would give too many voxels on the surface.
        const WorldBox box = bounding_box(distinct);
        double area = 0;
        for (int a = 0; a < 3; ++a)
            area += 2 * (box.max[a] - box.min[a]) * (box.max[(a + 1) % 3] - box.min[(a + 1) % 3]);
        if (const double minimum = std::sqrt(area / kAutomatic.max_box_voxels);
            minimum > std::min(times, 1.0) * spacing)
            return VoxelSizeChoice{
                minimum, number(kAutomatic.max_box_voxels) +
                             " voxels on the sides of the points' bounding box; the median distance of the points is " +
                             number(spacing)};
        if (times >= 1) return nearest(spacing);
        return VoxelSizeChoice{times * spacing, "finer than the median distance between neighbouring points, " +
                                                    number(spacing) + ", because there are few"};
    };
    if (distinct.size() > kAutomatic.max_guess_marks) {
        const CloudScale scale = measure_cloud_scale(distinct);
        const double h = kCommon.precision_voxels * scale.noise;
        if (h <= scale.nearest) return nearest(scale.nearest);
        return {h, number(kCommon.precision_voxels) + " times the noise of the points, " + number(scale.noise)};
    }
    const double spacing = measure_spacing(distinct).median;
    // A guess is smooth between its points, regardless of their noise: its surface gets as many voxels as one through
    // the maximum number of marks of a guess.
    if (!tagged) return finer(spacing, double(kAutomatic.max_guess_marks));
    const ScanVoxelSize scan = choose_scan_voxel_size(distinct, spacing);
    // With few points and voxels as large as their spacing, the surface would be so few voxels wide that curvature
    // would outweigh the points.
    if (scan.voxel_size <= spacing) return finer(spacing, kAutomatic.few_points);
    return {scan.voxel_size, "on average the points lie " + number(scan.thickness) +
                                 " from their local plane, a noise larger than their median distance " +
                                 number(spacing)};
}

}  // namespace covol
