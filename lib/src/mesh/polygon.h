#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "covol/fwd.h"

namespace covol::meshing {

/// A polygon of more corners than this, which is not convex, is not cut into triangles.
inline constexpr std::size_t kMaxPolygonCorners = 20000;

/// Cuts a polygon, flat or nearly so, into triangles of its corners, n - 2 of them, with the polygon's orientation. It
/// may be concave, and pass an edge twice on its way to a hole. Fans where they do.
/// @returns by the corners' numbers; empty for concave ones of more than kMaxPolygonCorners
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> cut_polygon(const std::vector<Vec3>& corners);

}  // namespace covol::meshing
