#include "segment/automatic.h"

#include <algorithm>
#include <cmath>

#include "base/median.h"
#include "base/valid.h"
#include "covol/error.h"
#include "covol/scan_noise.h"
#include "segment/heuristics.h"

namespace covol {
namespace pipeline {
namespace {

// A thick layer of points, or several beside each other, has its surface in the middle.
void average_noise(Job& job) {
    const double radius = kAutomatic.scan_radius_voxels * job.h(),
                 thickness = measure_layer_thickness(job.points, radius, job.run);
    if (!(thickness > kAutomatic.noisy_share * job.h())) return;
    job.points = average_layers(job.points, radius, job.run);
    job.choose("points_averaged", "within " + number(radius),
               "they lie " + number(thickness) + " from their local plane on the mean, more than " +
                   number(kAutomatic.noisy_share) + " voxels");
}

void merge_points(Job& job) {
    const std::size_t all = job.points.size();
    job.points = merge_close_points(job.points, kAutomatic.merge_voxels * job.h());
    if (job.points.size() < all)
        job.run.info("points: " + std::to_string(job.points.size()) + " of " + std::to_string(all) +
                     " kept, the others are closer than half of " + number(kAutomatic.merge_voxels * job.h()));
    job.marks = job.points;
}

void choose_attraction_range(Job& job) {
    job.has_automatic_range = true;
    std::optional<double>& chosen = job.options.evolve.attraction_range;
    chosen = 0;
    if (!job.uses_points()) return;
    if (job.tags() && job.uses_image()) {
        const double range = kAutomatic.tag_attraction_voxels * job.h();
        chosen = range;
        job.choose("attraction_range", number(range),
                   number(kAutomatic.tag_attraction_voxels) + " voxels: farther from marks the image decides");
    } else if (job.tags()) {
        job.choose("attraction_range", "0", "unlimited: the band around the points bounds it");
    } else {
        const double range = kAutomatic.attraction_voxels * job.h();
        chosen = range;
        job.choose("attraction_range", number(range), number(kAutomatic.attraction_voxels) + " voxels");
    }
}

constexpr double kMostReach = 1 << 22;  // voxels from a lattice's origin, with room around

// One wild point makes a domain that no lattice holds.
void check_extent(const Job& job) {
    if (job.image != nullptr || job.points.size() < 8) return;
    if (std::sqrt(3.0) * longest_side(bounding_box(job.points)) < kMostReach * job.h()) return;
    Vec3 middle{};
    for (int a = 0; a < 3; ++a) {
        std::vector<double> values;
        for (const Vec3& p : job.points) values.push_back(p[a]);
        middle[a] = cloud::median(std::move(values));
    }
    std::vector<double> away;
    for (const Vec3& p : job.points) away.push_back(std::hypot(p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]));
    const auto farthest = std::max_element(away.begin(), away.end()) - away.begin();
    const double far = away[std::size_t(farthest)];
    std::nth_element(away.begin(), away.begin() + std::ptrdiff_t(away.size() * 99 / 100), away.end());
    const double most = away[away.size() * 99 / 100];
    if (far < kAutomatic.wild_point * most || far < kMostReach * job.h()) return;
    const Vec3& p = job.points[std::size_t(farthest)];
    throw Error(Errc::InvalidInput, "points: (" + number(p[0]) + ", " + number(p[1]) + ", " + number(p[2]) + ") lies " +
                                        number(far) + " from the middle of all points, " + number(far / most) +
                                        " times as far as 99 % of them: leave it out, if it is a mistake");
}

// Tagging needs marks that lie closer together than the body is thick anywhere, by far; the guess does not.
void choose_start(Job& job) {
    Start::Kind& kind = job.options.start.kind;
    if (kind != Start::Kind::Auto || !job.starts_from_marks()) return;
    kind = Start::Kind::Tag;
    if (!job.guided() || job.options.contours || job.options.tag_distance ||
        job.points.size() > kAutomatic.most_guess_marks)
        return;
    if (job.image == nullptr && !can_enclose(job.points)) return;  // a layer: tagging tells what it needs
    kind = Start::Kind::Guess;
    job.choose("start", "guess",
               std::to_string(job.points.size()) + " marks, at most " + std::to_string(kAutomatic.most_guess_marks));
}

// Points without an image that enclose something tell inside from outside themselves.
void try_cloud(Job& job) {
    Start::Kind& kind = job.options.start.kind;
    const bool asked = kind == Start::Kind::Cloud;
    if (!job.starts_from_marks() || !(asked || kind == Start::Kind::Auto)) return;
    if (asked && job.image != nullptr)
        throw Error(Errc::InvalidOptions, "segment: the start 'cloud' is for points without an image");
    const SegmentOptions& o = job.options;
    const bool has_seeds =
        !o.exterior_seeds.empty() || !job.hole_seeds.empty() || !o.inside.empty() || !o.outside.empty();
    if (!asked && (!job.guided() || o.contours || o.tag_distance || has_seeds || job.image != nullptr ||
                   !job.uses_points() || job.points.size() <= kAutomatic.most_guess_marks || !can_enclose(job.points)))
        return;
    Timed timed(job.report().seconds.tag);
    job.cloud =
        orient_cloud(job.points, job.points.size() == job.given.size() ? job.options.hints : PointHints{}, job.run);
    kind = Start::Kind::Cloud;
    if (job.cloud->encloses || !job.options.voxel_size_may_grow) return;
    // The indicator is all that there is to see.
    const double h = kAutomatic.view_voxel * job.cloud->orientation.screened->cell();
    if (h <= job.h()) return;
    job.options.voxel_size = h;
    job.choose("voxel_size", number(h), number(kAutomatic.view_voxel) + " cells of the indicator");
}

}  // namespace

void check_input(Job& job) {
    detail::require_valid(job.options, "segment");
    if (job.image == nullptr && job.points.empty())
        throw Error(Errc::InvalidInput, "segment: expected an image or points, got neither");
    if (job.starts_from_marks() && job.points.empty())
        throw Error(Errc::InvalidInput,
                    "segment: the start 'tag' expects points, got none; give points, contours or seeds inside, or "
                    "choose another start (sphere, box, mesh, mask or vdb)");
    check_sides(job.options.inside, job.options.outside, kAutomatic.same_seed_voxels * job.h());
    job.report().point_count = job.given.size();
    EvolveOptions& evolve = job.options.evolve;
    if (job.points.empty() && evolve.theta > 0) {
        evolve.theta = 0;
        job.choose("theta", "0", "there are no points");
    }
    if (job.image == nullptr && evolve.rho > 0) {
        evolve.rho = 0;
        job.choose("rho", "0", "there is no image");
    }
}

void choose_values(Job& job) {
    SegmentOptions& options = job.options;
    if (!options.voxel_size) {
        options.voxel_size_may_grow = true;
        const VoxelSizeChoice choice =
            job.image != nullptr ? choose_voxel_size(*job.image) : choose_voxel_size(job.points, options.tags_points());
        options.voxel_size = choice.voxel_size;
        job.choose("voxel_size", number(job.h()), choice.reason);
    }
    check_extent(job);
    try_cloud(job);
    merge_points(job);
    choose_start(job);
    if (job.image == nullptr && job.tags()) average_noise(job);
    const double h = job.h();
    EvolveOptions& evolve = options.evolve;
    const bool marked = job.tags() || job.guesses();  // the start is close to the end
    const double delta_voxels = marked ? kAutomatic.tag_delta_voxels : 1.0;
    const bool chooses_delta = !evolve.delta;
    if (chooses_delta) evolve.delta = delta_voxels * h;
    if (job.options.guess || ((job.guesses() || job.is_cloud()) && job.guided() && job.uses_points()))
        return;  // nothing flows; a later frame may
    if (chooses_delta) job.choose("delta", number(*evolve.delta), number(delta_voxels) + " voxels");
    evolve.solver_tolerance = evolve.solved_to();  // before coarse levels have time steps of their own
    if (!evolve.tau) job.choose("tau", number(h), "1 voxel at unit speed; longer while the surface moves slowly");
    if (!options.edge.sigma && job.uses_image()) {
        const double voxels = job.tags() ? kAutomatic.tag_sigma_voxels : 1.0;
        job.choose("sigma", number(*(options.edge.sigma = voxels * h)), number(voxels) + " voxels");
    }
    if (!evolve.attraction_range) choose_attraction_range(job);
    if (!evolve.image_yields) {
        evolve.image_yields = job.tags() && job.uses_points() && job.uses_image() ? 1.0 : 0.0;
        if (*evolve.image_yields > 0)
            job.choose("image_yields", "1", "near marks the marks know better than the edges");
    }
}

}  // namespace pipeline

VoxelSizeChoice choose_voxel_size(const Image& image) {
    const Vec3& spacing = image.geometry().spacing;
    return {*std::min_element(spacing.begin(), spacing.end()), "the image's smallest spacing"};
}

VoxelSizeChoice choose_voxel_size(const std::vector<Vec3>& world_points, bool tagged) {
    using pipeline::number;
    const std::vector<Vec3> distinct = merge_close_points(world_points, 0);
    if (distinct.size() < 2)
        throw Error(Errc::InvalidInput, "choose_voxel_size: expected an image or at least 2 distinct points, got " +
                                            std::to_string(distinct.size()));
    const auto nearest = [](double spacing) {
        return VoxelSizeChoice{spacing, "the median distance between neighbouring points"};
    };
    const auto finer = [&](double spacing, double enough) {
        const double times = std::sqrt(double(distinct.size()) / enough);
        if (times >= 1) return nearest(spacing);
        return VoxelSizeChoice{times * spacing, "finer than the median distance between neighbouring points, " +
                                                    number(spacing) + ", for there are few"};
    };
    if (distinct.size() > kAutomatic.most_guess_marks) {
        const CloudScale scale = measure_cloud_scale(distinct);
        const double h = kAutomatic.cloud_noise * scale.noise;
        if (h <= scale.nearest) return nearest(scale.nearest);
        return {h, number(kAutomatic.cloud_noise) + " times the noise of the points, " + number(scale.noise)};
    }
    const double spacing = measure_spacing(distinct).median;
    // A guess is known between its points, noise or not: it has as many voxels as one of the most points.
    if (!tagged) return finer(spacing, double(kAutomatic.most_guess_marks));
    const ScanVoxelSize scan = choose_scan_voxel_size(distinct, spacing);
    // A surface of few points is so few spacings wide that in voxels as large as they are curvature would outweigh
    // them.
    if (scan.voxel_size <= spacing) return finer(spacing, kAutomatic.few_points);
    return {scan.voxel_size, "points lie " + number(scan.thickness) +
                                 " from their local plane on the mean, noise wider than their median distance " +
                                 number(spacing)};
}

}  // namespace covol
