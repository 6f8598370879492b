#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "covol/fwd.h"

namespace covol::meshing {

/// Maximum number of corners of a non-convex polygon that is cut into triangles.
inline constexpr std::size_t kMaxPolygonCorners = 20000;

/// Cuts a polygon of n corners that is flat, or nearly so, into n - 2 triangles with the polygon's orientation. The
/// polygon may be concave, and contain an edge twice that leads to a hole and back. Uses a fan if possible.
/// @returns triangles of the corners' numbers; empty for concave polygons of more than kMaxPolygonCorners
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> cut_polygon(const std::vector<Vec3>& corners);

}  // namespace covol::meshing
