#pragma once
// Normals that do not stand on the sheet of points on which they are.
#include <cstddef>
#include <vector>

#include "covol/domain.h"

namespace covol::cloud {

/// Where the lattice is as fine as the points, parts of a sheet can end with normals in all directions or turned over:
/// each agrees with the indicator that they make, which is torn there. Where the nearest points are flat, for there is
/// hardly any noise, the sheet itself tells: a normal far from the sheet's is set upright, to the side of the good ones
/// beside it, from these inwards; and of two parts of a sheet whose normals meet back to front the smaller one is
/// turned over.
/// @param spacing  of the points
/// @param normals  in/out, unit or 0
/// @return how many were mended
std::size_t mend_torn(const std::vector<Vec3>& points, double spacing, std::vector<Vec3>& normals);

}  // namespace covol::cloud
