#pragma once
#include <optional>
#include <vector>

#include "covol/image.h"

namespace covol::tool {

/// The ratio of the mean edge strengths at the marks if their coordinates are read as voxels, and as lengths; nullopt
/// if the edges are not clearly stronger with voxels, if the marks would not all be inside the image, or if both
/// readings are equivalent.
/// @param marks  the numbers of the file, read as world positions, inside the image
/// @throws Error InvalidInput (a damaged chunk).
[[nodiscard]] std::optional<double> edges_if_voxels(const std::vector<Vec3>& marks, const Image& image);

}  // namespace covol::tool
