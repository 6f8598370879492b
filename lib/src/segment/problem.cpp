#include "segment/problem.h"

#include <algorithm>
#include <cmath>

namespace covol::pipeline {

Problem::Problem(const Image* image_or_null, const std::vector<Vec3>& points, const SegmentOptions& segment_options,
                 const RunContext& context)
    : image(image_or_null), options(segment_options), run(context), given(points), points_(points) {
    require_valid(options, "segment");
    if (options.contours) {
        const std::vector<Vec3>& marked = options.contours->marks;
        given.insert(given.end(), marked.begin(), marked.end());
    }
    if (image == nullptr && given.empty())
        throw Error(Errc::InvalidInput, "segment: expected an image or points, got neither");
}

MarkSets Problem::marks() const {
    MarkSets sets{points_, points_};
    if (!options.contours) return sets;
    const Contours& contours = *options.contours;
    sets.trusted.insert(sets.trusted.end(), contours.along.begin(), contours.along.end());
    sets.attracting = sets.trusted;
    sets.attracting.insert(sets.attracting.end(), contours.between.begin(), contours.between.end());
    return sets;
}

Domain Problem::domain_with_margin(double h, const std::vector<Vec3>& points, double margin) const {
    std::optional<WorldBox> whole;
    if (image != nullptr) whole = image->geometry().world_box();
    const WorldBox box = options.roi ? *options.roi : whole ? *whole : bounding_box(points, margin);
    return choose_domain(box, h, whole, options.lattice_origin);
}

Domain Problem::domain(double h, const std::vector<Vec3>& points, double margin) const {
    return domain_with_margin(h, points, options.margin.value_or(margin));
}

Domain Problem::coarsened(const Domain& fine, double h) const {
    Domain lattice = fine;
    lattice.voxel_size = h;
    if (image != nullptr && !options.lattice_origin)
        lattice = make_domain(make_domain(image->geometry().world_box(), fine.voxel_size).world_box(), h);
    else  // aligns the outer faces of the voxels (0,0,0) of both lattices
        for (double& x : lattice.origin) x += 0.5 * (h - fine.voxel_size);
    return covering(lattice, fine.world_box());
}

Clip Problem::clip() const {
    Clip all = image != nullptr ? make_clip(image->geometry()) : Clip{};
    if (!options.roi) return all;
    const Clip region = make_clip(*options.roi);
    all.insert(all.end(), region.begin(), region.end());
    return all;
}

bool Problem::is_turned() const {
    if (image == nullptr) return false;
    for (const auto& row : image->geometry().direction)
        for (const double x : row)
            if (std::min(std::abs(x), std::abs(std::abs(x) - 1)) > 1e-6) return true;
    return false;
}

}  // namespace covol::pipeline
