#pragma once
// Where two or three sheets meet: edges, grooves and corners.
#include <optional>
#include <vector>

#include "cloud/surface/sheet.h"

namespace covol::cloud {

struct CreasePoint {
    Vec3 place, normal;
    double weight;
};

/// The sheets that meet among the points, if these explain them better than one quadric, which has about as many
/// parameters as two planes have: points are divided by their normals, then each goes to the sheet that it is closest
/// to, in turns with the fit of each sheet (k-planes: Bradley and Mangasarian, J. Global Optimization 16, 2000). As
/// sharp features of Ohtake and others, Multi-level partition of unity implicits, ACM Trans. Graphics 22(3), 2003, they
/// are combined by maximum where the solid is convex and by minimum where it is concave.
/// @param origin  of the neighbourhood
/// @param radius  of it, > 0
[[nodiscard]] std::optional<Crease> fit_crease(const std::vector<CreasePoint>& points, const Vec3& origin,
                                               double radius);

}  // namespace covol::cloud
