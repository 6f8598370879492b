#pragma once
#include "covol/study.h"

namespace covol::detail {

/// @throws Error InvalidInput if the newest stroke is invalid, or if with it the paint would take too much memory or
/// time.
void require_paintable(const StudyStructure& structure, const ImageGeometry& image);

}  // namespace covol::detail
