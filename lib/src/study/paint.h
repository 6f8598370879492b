#pragma once
#include "covol/study.h"

namespace covol::detail {

/// @throws Error InvalidInput: the newest stroke is no stroke, or with it the paint would take too much memory or time.
void require_paintable(const StudyStructure& structure, const ImageGeometry& image);

}  // namespace covol::detail
