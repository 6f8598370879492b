#pragma once
#include "covol/points.h"

namespace covol::detail {

/// A position as a cloud has it, in the world. @pre space_after() gave the space
[[nodiscard]] Vec3 to_world(PointSpace space, const Vec3& p, const ImageGeometry& geometry);

/// What lengths of a cloud are multiplied with to become the image's; 1 where one of them names no known unit.
[[nodiscard]] double unit_factor(const PointCloud& cloud, const ImageGeometry& geometry);
/// The lengths of a position multiplied, not its voxels and slices.
[[nodiscard]] Vec3 scaled(PointSpace space, const Vec3& p, double factor);

}  // namespace covol::detail
