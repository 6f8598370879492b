#pragma once
// Repair of normals that are not perpendicular to their sheet of points or are reversed.
#include <cstddef>
#include <vector>

#include "covol/domain.h"

namespace covol::cloud {

/// If the cells of the indicator are as small as the spacing of the points, the normals of parts of a sheet may
/// converge to arbitrary or reversed directions, which agree with the indicator that they cause. If there is hardly any
/// noise, the nearest points determine the sheet: a normal that is far from perpendicular to its sheet is replaced by
/// the sheet's normal, on the side of the neighbours' normals; and of two parts of a sheet with opposite normals, the
/// normals of the smaller one are reversed.
/// @param spacing  mean distance of neighbouring points, world units
/// @param normals  in/out, unit or 0
/// @return number of normals that were changed
std::size_t repair_torn(const std::vector<Vec3>& points, double spacing, std::vector<Vec3>& normals);

}  // namespace covol::cloud
