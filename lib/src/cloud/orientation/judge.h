#pragma once
// What speaks for and against an orientation, and how fine its grids may be.
#include <vector>

#include "covol/orientation.h"

namespace covol::cloud {

/// Of the finest grid, world units: no finer than so many points tell.
[[nodiscard]] double finest_cell(const CloudScale& scale, std::size_t points);
/// The same of the first tries: on larger cells fewer normals turn, and only thin parts ask for smaller ones.
[[nodiscard]] double first_cell(const CloudScale& scale, const std::vector<Vec3>& points);

/// Parts that are turned as a whole go on turning, or lie where the indicator is not 1/2.
[[nodiscard]] double doubt(const Orientation& orientation);
[[nodiscard]] bool is_settled(const Orientation& orientation);

/// Share of the points that the indicator's level 1/2 passes by at more than that distance, world units.
[[nodiscard]] double fraction_passed(const Indicator& indicator, const std::vector<Vec3>& points, double reach);

}  // namespace covol::cloud
