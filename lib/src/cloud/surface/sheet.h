#pragma once
// A piece of a smooth surface, and creases in which several pieces meet.
#include <array>
#include <cstddef>

#include "covol/domain.h"

namespace covol::cloud {

/// Two directions perpendicular to a unit normal, and the normal.
[[nodiscard]] std::array<Vec3, 3> frame_of(const Vec3& normal);

/// A quadric as the height over a plane: t = c0 + c1 u + c2 v + c3 u^2 + c4 uv + c5 v^2, world units.
struct Sheet {
    Vec3 origin;
    std::array<Vec3, 3> axes;  ///< u, v and the normal, outward
    std::array<double, 6> c;
    /// First-order signed distance, > 0 outside.
    [[nodiscard]] double distance(const Vec3& world) const;
    /// Outward unit normal of the sheet at the position above or below `world`.
    [[nodiscard]] Vec3 normal(const Vec3& world) const;
    [[nodiscard]] double curvature() const;  ///< larger absolute principal curvature at the foot, approximately
    [[nodiscard]] Vec3 foot() const;         ///< the sheet's point above or below `origin`
};

/// Two or three sheets that meet. Each bounds a solid that lies below it. The solid of the crease is the intersection
/// of the first one with the others if first_is_convex is set, else their union; with three sheets, `others` stands for
/// the intersection or the union of the second and the third, depending on others_are_convex.
struct Crease {
    std::array<Sheet, 3> sheets;
    std::size_t count = 0;
    bool first_is_convex = true;    ///< whether the solid is convex between the first and the others
    bool others_are_convex = true;  ///< the same between the second and the third
    double misfit = 0;              ///< root mean square distance of the points from the crease's surface
    [[nodiscard]] double distance(const Vec3& world) const;
    /// The sheet that determines the distance.
    [[nodiscard]] std::size_t nearest(const Vec3& world) const;
    /// One bit for each sheet that determines the distance, or would if its own distance changed by at most `within`:
    /// one sheet on a face, two on an edge. The continuation of a sheet beyond a crease does not count.
    [[nodiscard]] unsigned sheets_at(const Vec3& world, double within) const;
    [[nodiscard]] Vec3 mean_normal() const;
};

}  // namespace covol::cloud
