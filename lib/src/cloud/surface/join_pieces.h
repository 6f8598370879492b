#pragma once
#include <cstddef>
#include <vector>

#include "covol/domain.h"
#include "covol/run.h"

namespace covol::cloud {

/// Joins small pieces of a solid to the nearest other piece if there are points all along the gap, because parts as
/// thin as the spacing of the points may be torn off. Pieces of less than a tenth of the volume of the largest are
/// small; larger ones are not joined to each other, however close they are.
/// @param level_set  active near its surface and signed everywhere; values at the joints have the right sign but are
/// not distances
/// @param apart  spacing of the points or their noise, if that is larger
/// @return number of pieces that were joined
std::size_t join_pieces(FloatGrid& level_set, const std::vector<Vec3>& points, double apart, const RunContext& run);

/// The number of pieces of a solid that are not small.
[[nodiscard]] std::size_t count_large_pieces(const FloatGrid& level_set, const RunContext& run);

}  // namespace covol::cloud
