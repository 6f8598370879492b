#pragma once
#include <string>
#include <vector>

#include "covol/pipeline.h"

namespace covol::pipeline {

/// Fills `fit.bias` and `marks_off`, whose `beyond` is known, of the report on a surface.
/// @param distances  of each mark to the surface
/// @return what a person has to look at, one line each
[[nodiscard]] std::vector<std::string> compare_with_marks(SegmentReport& report, const FloatGrid& surface,
                                                          const Image* image, const std::vector<Vec3>& marks,
                                                          const std::vector<double>& distances);

}  // namespace covol::pipeline
