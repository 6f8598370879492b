#pragma once
#include <optional>
#include <vector>

#include "covol/image.h"

namespace covol::tool {

/// Tests whether coordinates that were read as lengths are probably voxel indices. If read as indices, the marks then
/// lie at stronger edges of the image. Returns the ratio of the mean edge strengths at the marks for the two readings,
/// indices / lengths. Nullopt if the ratio is at most 2 or the edges are stronger at fewer than 70 % of the marks, or
/// if the test is impossible: too few marks, marks outside, readings within a voxel of each other, unknown spacing.
/// @param marks  the numbers of the file, inside the image if read as world positions
/// @throws Error InvalidInput (a damaged chunk).
[[nodiscard]] std::optional<double> edges_if_voxels(const std::vector<Vec3>& marks, const Image& image);

}  // namespace covol::tool
