#pragma once
#include <string>
#include <vector>

#include "covol/pipeline.h"

namespace covol::pipeline {

/// Fills `fit.bias` and `marks_off` of the report on a surface. @pre report.marks_off.beyond is set: the distance
/// beyond which a mark is counted as off the surface
/// @param distances  of each mark to the surface
/// @return warnings for the user, one line each
[[nodiscard]] std::vector<std::string> compare_with_marks(SegmentReport& report, const FloatGrid& surface,
                                                          const Image* image, const std::vector<Vec3>& marks,
                                                          const std::vector<double>& distances);

}  // namespace covol::pipeline
