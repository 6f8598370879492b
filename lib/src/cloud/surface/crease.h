#pragma once
// Edges, grooves and corners, where two or three sheets meet.
#include <optional>
#include <vector>

#include "cloud/surface/sheet.h"

namespace covol::cloud {

struct CreasePoint {
    Vec3 place, normal;
    double weight;
};

/// Two or three sheets that meet in the neighbourhood, if they fit the points much better than one quadric, which has
/// about as many parameters as two planes; otherwise none. Points are divided by their normals; then assignment of each
/// point to its closest sheet alternates with the fit of the sheets (k-planes: Bradley and Mangasarian, J. Global
/// Optimization 16, 2000). Like the sharp features of Ohtake et al., Multi-level partition of unity implicits, ACM
/// Trans. Graphics 22(3), 2003, sheets are combined by the maximum where the solid is convex and by the minimum where
/// it is concave.
/// @param origin  of the neighbourhood
/// @param radius  of the neighbourhood, > 0
[[nodiscard]] std::optional<Crease> fit_crease(const std::vector<CreasePoint>& points, const Vec3& origin,
                                               double radius);

}  // namespace covol::cloud
