#pragma once
#include <optional>
#include <vector>

#include "covol/image.h"

namespace covol::tool {

/// How much stronger the image's edges are, on the mean, where marks would lie if they were voxels and not lengths;
/// nothing where they are not clearly stronger, where the marks would not all lie inside the image, or where both mean
/// the same.
/// @param marks  the numbers of the file, taken as world positions, inside the image
/// @throws Error InvalidInput (a damaged chunk).
[[nodiscard]] std::optional<double> edges_if_voxels(const std::vector<Vec3>& marks, const Image& image);

}  // namespace covol::tool
