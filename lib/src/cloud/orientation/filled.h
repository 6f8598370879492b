#pragma once
// Points that fill a solid, and lie on no surface.
#include <vector>

#include "covol/orientation.h"

namespace covol::cloud {

/// Whether no neighbourhood of the points is a sheet, from small ones to such that hold an eighth of all: a sheet's
/// points have a small part of its radius as their standard deviation along its normal once it is wider than their
/// noise, those that fill a ball have 0.45 of it at any size.
/// @param spacing  about the distance of the points, world units
[[nodiscard]] bool fill_a_solid(const std::vector<Vec3>& points, double spacing, const RunContext& run);

/// Of points that do: the indicator is their density in units of what its median over the points is, so that its level
/// 1/2 is where a solid that they fill evenly ends; normals point to where there are fewer.
/// @param scale  of the points: near_reach tells how dense they are
[[nodiscard]] Orientation orient_filled(const std::vector<Vec3>& points, const CloudScale& scale);

}  // namespace covol::cloud
