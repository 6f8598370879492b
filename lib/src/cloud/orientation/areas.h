#pragma once
#include <vector>

#include "covol/domain.h"

namespace covol::cloud {

/// Of the surface around each point, world units squared: the disc to its eighth neighbour. A density on a lattice
/// would count the other side of thin parts, too.
[[nodiscard]] std::vector<double> areas_of(const std::vector<Vec3>& points, double spacing);

}  // namespace covol::cloud
