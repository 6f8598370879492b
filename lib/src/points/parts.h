#pragma once
// Parts of a cloud that are far apart compared to their size.
#include <vector>

#include "covol/domain.h"

namespace covol::cloud {

/// The longest side of the bounding box of the cloud's largest part, world units. Parts are separate if an empty cell
/// lies between them, for cells of 1 / `resolution` of the longest side. If all parts are clearly smaller than the
/// whole, the largest one is divided in the same way again.
/// @param edge  minimum edge length of a cell, world units, > 0: large enough for neighbouring points to be in adjacent
/// cells
[[nodiscard]] double largest_part_side(const std::vector<Vec3>& points, double resolution, double edge);

/// The points of that part; all points if the cloud is in one part.
[[nodiscard]] std::vector<Vec3> largest_part(const std::vector<Vec3>& points, double resolution, double edge);

}  // namespace covol::cloud
