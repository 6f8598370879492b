#pragma once
// Criteria for and against an orientation, and the cell size of its grids.
#include <vector>

#include "covol/orientation.h"

namespace covol::cloud {

/// Cell of the finest grid, world units, limited by the number of points.
[[nodiscard]] double finest_cell(const CloudScale& scale, std::size_t points);
/// Cell of the first attempts: with larger cells fewer normals turn, and only thin parts require smaller ones.
[[nodiscard]] double first_cell(const CloudScale& scale, const std::vector<Vec3>& points);

/// Doubt that an orientation is right: normals keep turning, or the mean of the indicator is not 1/2 at the points, if
/// parts are turned as a whole.
[[nodiscard]] double doubt(const Orientation& orientation);
[[nodiscard]] bool is_settled(const Orientation& orientation);

/// Fraction of the points from which the indicator's level 1/2 is farther than `reach`, world units.
[[nodiscard]] double fraction_missed(const Indicator& indicator, const std::vector<Vec3>& points, double reach);

}  // namespace covol::cloud
