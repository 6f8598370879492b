#pragma once
#include <vector>

#include "covol/fwd.h"

namespace covol::detail {

/// The marks, and between neighbours so many points of the straight line that none is farther than `step` from the
/// next.
[[nodiscard]] std::vector<Vec3> subdivide(const std::vector<Vec3>& marks, bool closed, double step);

/// Vertices on the centripetal Catmull-Rom curve through the marks, about `step` apart. Fewer than three marks are
/// returned as they are. @pre no two neighbours are equal
[[nodiscard]] std::vector<Vec3> centripetal_curve(const std::vector<Vec3>& marks, bool closed, double step);

[[nodiscard]] double length_of(const std::vector<Vec3>& curve, bool closed);

/// Places about `step` apart along a curve, its first point among them. @pre the curve has a point, step > 0
[[nodiscard]] std::vector<Vec3> evenly_along(const std::vector<Vec3>& curve, bool closed, double step);

}  // namespace covol::detail
