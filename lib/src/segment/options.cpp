// What SegmentOptions says about itself.
#include <cmath>

#include "base/valid.h"
#include "covol/pipeline.h"

namespace covol {

const char* to_string(Model model) { return model == Model::Guided ? "guided" : "paper"; }

std::string SegmentOptions::why_invalid() const {
    detail::FieldChecks checks;
    checks.expect_not_negative("mark_precision", mark_precision);
    checks.expect_positive("voxel_size", voxel_size);
    checks.expect_not_negative("margin", margin);
    checks.expect_positive("tag_distance", tag_distance);
    checks.expect_positive("holes.distance", holes.distance);
    if (coarse_levels) checks.expect_not_negative("coarse_levels", double(*coarse_levels));
    if (start.kind == Start::Kind::Sphere) checks.expect_positive("start.radius", start.radius);
    if (roi)
        for (int a = 0; a < 3; ++a)
            checks.expect(roi->max[a] > roi->min[a], "roi", "min < max along each axis", roi->max[a] - roi->min[a]);
    checks.expect(
        !without_mesh || (holes.policy == Holes::Close && extract.min_component_volume == 0 && extract.isovalue == 0),
        "without_mesh", "false where holes are treated, pieces dropped or another level is wanted", without_mesh);
    checks.add(edge.why_invalid());
    checks.add(evolve.why_invalid());
    return checks.lines();
}

bool SegmentOptions::tags_points() const {
    const bool from_points =
        start.kind == Start::Kind::Auto || start.kind == Start::Kind::Guess || start.kind == Start::Kind::Cloud;
    return !from_points || model == Model::Paper || contours != nullptr || tag_distance.has_value();
}

}  // namespace covol
