#include "segment/job.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace covol::pipeline {

Job::Job(const Image* image_or_null, const std::vector<Vec3>& world_points, SegmentOptions segment_options,
         const RunContext& context)
    : image(image_or_null),
      points(world_points),
      trusted(world_points),
      given(world_points),
      options(std::move(segment_options)),
      run(context) {
    if (!options.contours) return;
    const Contours& contours = *options.contours;
    given.insert(given.end(), contours.marks.begin(), contours.marks.end());
    trusted.insert(trusted.end(), contours.along.begin(), contours.along.end());
    points = trusted;
    points.insert(points.end(), contours.between.begin(), contours.between.end());
    report().densified = contours.along.size() + contours.between.size();
}

void Job::choose(const std::string& what, const std::string& value, const std::string& reason) {
    const std::string line = value + (reason.empty() ? "" : " (" + reason + ")");
    report().automatic[what] = line;
    run.info(what + ": " + line);
}

void Job::warn(const std::string& line) {
    report().warnings.push_back(line);
    run.warn(line);
}

Domain Job::domain_with_margin(double margin) const {
    std::optional<WorldBox> whole;
    if (image != nullptr) whole = image->geometry().world_box();
    const WorldBox box = options.roi ? *options.roi : whole ? *whole : bounding_box(points, margin);
    return choose_domain(box, h(), whole, options.lattice_origin);
}

Domain Job::coarsened(const Domain& fine) const {
    Domain lattice = fine;
    lattice.voxel_size = h();
    if (image != nullptr && !options.lattice_origin)
        lattice = make_domain(make_domain(image->geometry().world_box(), fine.voxel_size).world_box(), h());
    else  // the faces of voxel (0,0,0) meet
        for (double& x : lattice.origin) x += 0.5 * (h() - fine.voxel_size);
    return covering(lattice, fine.world_box());
}

Domain Job::domain_with_chosen_margin(double automatic) const {
    return domain_with_margin(options.margin.value_or(automatic));
}

bool Job::is_turned() const {
    if (image == nullptr) return false;
    for (const auto& row : image->geometry().direction)
        for (const double x : row)
            if (std::min(std::abs(x), std::abs(std::abs(x) - 1)) > 1e-6) return true;
    return false;
}

Clip Job::where_it_ends() const {
    Clip all = image != nullptr ? make_clip(image->geometry()) : Clip{};
    if (!options.roi) return all;
    const Clip region = make_clip(*options.roi);
    all.insert(all.end(), region.begin(), region.end());
    return all;
}

}  // namespace covol::pipeline
