#pragma once
#include <vector>

#include "covol/clip.h"

namespace covol::detail {

/// The half-spaces of the facets of the points' convex hull; empty if the points have no volume (fewer than four, or
/// all in one plane).
[[nodiscard]] std::vector<HalfSpace> convex_hull(const std::vector<Vec3>& points);

}  // namespace covol::detail
