#pragma once
#include <vector>

#include "covol/domain.h"

namespace covol::detail {

/// Removes small pieces and cavities of a solid that are not near a mark. They arise where a surface was moved by
/// different offsets on the two sides of a fold.
/// @param level_set  active in a band; negative inside
void drop_unmarked_pieces(FloatGrid& level_set, const std::vector<Vec3>& marks);

/// Removes pieces and cavities, except the largest of each, that have fewer than `minimum` points on their surface
/// (within a voxel). The new values there have the right sign but are not distances. @return the number removed
std::size_t drop_bare_pieces(FloatGrid& level_set, const std::vector<Vec3>& points, std::size_t minimum);

}  // namespace covol::detail
