#pragma once
#include "covol/points.h"

namespace covol::detail {

/// Converts a position of a cloud to world coordinates. @pre `space` is a result of space_after()
/// (io/points/point_reading.h)
[[nodiscard]] Vec3 to_world(PointSpace space, const Vec3& p, const ImageGeometry& geometry);

/// Factor from lengths of a cloud to those of the image; 1 if either of them has no known unit.
[[nodiscard]] double unit_factor(const PointCloud& cloud, const ImageGeometry& geometry);
/// Multiplies those components of a position that are lengths by `factor`, but not those that count voxels or slices.
[[nodiscard]] Vec3 scaled(PointSpace space, const Vec3& p, double factor);

}  // namespace covol::detail
