// What SegmentOptions says about itself.
#include <cmath>

#include "base/valid.h"
#include "covol/pipeline.h"

namespace covol {

const char* to_string(Model model) { return model == Model::Guided ? "guided" : "paper"; }

EvolveOptions SegmentOptions::automatic_evolve() {
    EvolveOptions options;
    options.attraction_range = -1;
    options.image_yields = -1;
    return options;
}

std::string SegmentOptions::why_invalid() const {
    detail::FieldChecks checks;
    checks.expect_not_negative("voxel_size", voxel_size);
    checks.expect_not_negative("margin", margin);
    checks.expect_not_negative("tag_distance", tag_distance);
    checks.expect_not_negative("holes.distance", holes.distance);
    if (start.kind == Start::Kind::Sphere) checks.expect_positive("start.radius", start.radius);
    if (roi)
        for (int a = 0; a < 3; ++a)
            checks.expect(roi->max[a] > roi->min[a], "roi", "min < max along each axis", roi->max[a] - roi->min[a]);
    EvolveOptions chosen = evolve;
    if (chosen.attraction_range == -1) chosen.attraction_range = 0;  // automatic
    if (chosen.image_yields == -1) chosen.image_yields = 0;
    checks.add(edge.why_invalid());
    checks.add(chosen.why_invalid());
    return checks.lines();
}

}  // namespace covol
