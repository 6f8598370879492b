#pragma once
#include <vector>

#include "covol/fwd.h"

namespace covol::detail {

/// The marks, and between neighbours as many points on the straight line as are needed for distances of at most `step`.
[[nodiscard]] std::vector<Vec3> subdivide(const std::vector<Vec3>& marks, bool closed, double step);

/// Vertices on the centripetal Catmull-Rom curve through the marks, about `step` apart. Fewer than three marks are
/// returned unchanged. @pre no two neighbours are equal
[[nodiscard]] std::vector<Vec3> centripetal_curve(const std::vector<Vec3>& marks, bool closed, double step);

[[nodiscard]] double length_of(const std::vector<Vec3>& curve, bool closed);

/// Positions about `step` apart along a curve, including its first point. @pre the curve has a point, step > 0
[[nodiscard]] std::vector<Vec3> evenly_along(const std::vector<Vec3>& curve, bool closed, double step);

}  // namespace covol::detail
