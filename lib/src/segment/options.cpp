// Queries on SegmentOptions.
#include "covol/pipeline.h"

namespace covol {

bool SegmentOptions::tags_points() const {
    return !is_any<AutoStart, GuessStart, CloudStart>(start) || model == Model::Paper || contours != nullptr ||
           tag_distance.has_value();
}

}  // namespace covol
