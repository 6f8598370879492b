#include "segment/job.h"

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
    if (options.roi) return make_domain(*options.roi, h());
    if (image != nullptr) return make_domain(image->geometry().world_box(), h());
    return make_domain(bounding_box(points, margin), h());
}

Domain Job::domain_with_chosen_margin(double automatic) const {
    return domain_with_margin(options.margin.value_or(automatic));
}

}  // namespace covol::pipeline
