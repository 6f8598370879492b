#pragma once
#include <cstddef>
#include <vector>

#include "covol/domain.h"
#include "covol/run.h"

namespace covol::cloud {

/// Joins small pieces of a solid to what is nearest to them, where points lie all along the gap: parts as thin as the
/// points are apart tear. What is less than a tenth of the largest piece is small; others stay for themselves, however
/// close.
/// @param level_set  active near its surface and signed everywhere; values where something was joined are of the right
/// sign,
///                   but no distances
/// @param apart  what points of one surface are apart, and off it: their spacing or noise
/// @return how many were joined
std::size_t join_pieces(FloatGrid& level_set, const std::vector<Vec3>& points, double apart, const RunContext& run);

/// How many pieces of a solid are not small.
[[nodiscard]] std::size_t count_large_pieces(const FloatGrid& level_set, const RunContext& run);

}  // namespace covol::cloud
