#pragma once
#include <optional>
#include <vector>

#include "covol/image.h"

namespace covol::tool {

/// Tests whether coordinates that were read as lengths are voxel indices. Returns the mean edge strength at the marks
/// if read as indices, divided by that if read as lengths. Nullopt if it is not clearly larger, if not all marks would
/// be inside the image, if both readings agree to less than a voxel, with few marks, or if the spacing is not known.
/// @param marks  the numbers of the file, inside the image if read as world positions
/// @throws Error InvalidInput (a damaged chunk).
[[nodiscard]] std::optional<double> edges_if_voxels(const std::vector<Vec3>& marks, const Image& image);

}  // namespace covol::tool
