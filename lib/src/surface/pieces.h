#pragma once
#include <vector>

#include "covol/domain.h"

namespace covol::detail {

/// Takes those small pieces and cavities of a solid away that no mark is near: where offsets differ across a fold they
/// tear some off.
/// @param level_set  active in a band; negative inside
void drop_unmarked_pieces(FloatGrid& level_set, const std::vector<Vec3>& marks);

/// Takes pieces and cavities away, the largest of each excepted, whose surface fewer than `least` points lie on (within
/// a voxel). Values where something went are of the right sign, but no distances. @return how many went
std::size_t drop_bare_pieces(FloatGrid& level_set, const std::vector<Vec3>& points, std::size_t minimum);

}  // namespace covol::detail
