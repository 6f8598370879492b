#pragma once
// Repair of normals that are not perpendicular to their sheet of points or are reversed.
#include <cstddef>
#include <vector>

#include "covol/domain.h"

namespace covol::cloud {

/// If the lattice is as fine as the points, parts of a sheet can end with normals in arbitrary directions or reversed:
/// each agrees with the resulting indicator, which is torn there. If the nearest points are flat because there is
/// hardly any noise, the sheet itself determines the direction: a normal far from the sheet's is replaced by the
/// sheet's, on the side of its correct neighbours, from these inwards; and of two parts of a sheet with opposite
/// normals the smaller one is reversed.
/// @param spacing  of the points
/// @param normals  in/out, unit or 0
/// @return how many were changed
std::size_t repair_torn(const std::vector<Vec3>& points, double spacing, std::vector<Vec3>& normals);

}  // namespace covol::cloud
