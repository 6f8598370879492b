// What SegmentOptions says about itself.
#include "covol/pipeline.h"

namespace covol {

bool SegmentOptions::tags_points() const {
    const bool from_points =
        start.kind == Start::Kind::Auto || start.kind == Start::Kind::Guess || start.kind == Start::Kind::Cloud;
    return !from_points || model == Model::Paper || contours != nullptr || tag_distance.has_value();
}

}  // namespace covol
