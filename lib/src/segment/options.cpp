// What SegmentOptions says about itself.
#include <cmath>

#include "base/number.h"
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
    std::string why;
    const auto expect = [&](bool ok, const char* field, const char* expected, double got) {
        if (ok) return;
        why += std::string(why.empty() ? "" : "\n") + field + ": expected " + expected + ", got " + detail::number(got);
    };
    expect(std::isfinite(voxel_size) && voxel_size >= 0, "voxel_size", ">= 0", voxel_size);
    expect(std::isfinite(margin) && margin >= 0, "margin", ">= 0", margin);
    expect(std::isfinite(tag_distance) && tag_distance >= 0, "tag_distance", ">= 0", tag_distance);
    expect(std::isfinite(holes.distance) && holes.distance >= 0, "holes.distance", ">= 0", holes.distance);
    if (start.kind == Start::Kind::Sphere)
        expect(std::isfinite(start.radius) && start.radius > 0, "start.radius", "> 0", start.radius);
    if (roi)
        for (int a = 0; a < 3; ++a)
            expect(roi->max[a] > roi->min[a], "roi", "min < max along each axis", roi->max[a] - roi->min[a]);
    EvolveOptions chosen = evolve;
    if (chosen.attraction_range == -1) chosen.attraction_range = 0;  // automatic
    if (chosen.image_yields == -1) chosen.image_yields = 0;
    for (const std::string& part : {edge.why_invalid(), chosen.why_invalid()})
        if (!part.empty()) why += (why.empty() ? "" : "\n") + part;
    return why;
}

}  // namespace covol
