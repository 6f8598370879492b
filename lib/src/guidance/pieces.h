#pragma once
#include <vector>

#include "covol/domain.h"

namespace covol::guidance {

/// Takes those small pieces and cavities of a solid away that no mark is near: where offsets differ across a fold they
/// tear some off.
/// @param level_set  active in a band; negative inside
void drop_unmarked_pieces(FloatGrid& level_set, const std::vector<Vec3>& marks);

}  // namespace covol::guidance
