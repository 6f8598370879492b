#pragma once
#include <vector>

#include "covol/domain.h"

namespace covol::detail {

/// Removes small pieces and cavities of a solid that are not near a mark: differences of offsets across a fold tear
/// some off.
/// @param level_set  active in a band; negative inside
void drop_unmarked_pieces(FloatGrid& level_set, const std::vector<Vec3>& marks);

/// Removes pieces and cavities, except the largest of each, that have fewer than `minimum` points on their surface
/// (within a voxel). Values where something was removed have the right sign but are no distances. @return how many were
/// removed
std::size_t drop_bare_pieces(FloatGrid& level_set, const std::vector<Vec3>& points, std::size_t minimum);

}  // namespace covol::detail
