#pragma once
#include "covol/points.h"

namespace covol::detail {

/// A position as a cloud has it, in the world. @pre space_after() gave the space
[[nodiscard]] Vec3 to_world(PointSpace space, const Vec3& p, const ImageGeometry& geometry);

}  // namespace covol::detail
