#pragma once
// Parallel projection of world positions onto the picture.
#include <array>
#include <vector>

#include "covol/domain.h"
#include "render/draw/canvas.h"

namespace covol::figure {

/// Directions of the picture's axes in the world; unit vectors.
struct Basis {
    Vec3 right, up, to_eye;
};

/// The basis of a view, with angles in degrees: azimuth 0 is a view from the front in the direction +y, azimuth 90 one
/// from the right in the direction -x, and elevation 90 one from above in the direction -z.
[[nodiscard]] Basis view_basis(double azimuth, double elevation);

/// Extent of an object along a basis' axes, world units.
struct Extent {
    double min[3] = {1e300, 1e300, 1e300}, max[3] = {-1e300, -1e300, -1e300};
    void add(double right, double up, double to_eye);
    void add(const Extent& other);
    [[nodiscard]] double size(int axis) const { return max[axis] - min[axis]; }
};

/// A view of the world in a part of the picture.
struct Camera {
    Basis basis;
    Vec3 center;       ///< world; projected to the middle of `at`
    double pixel = 1;  ///< size of a pixel, world units
    Rect at;

    /// x and y on the picture, pixels, and how much closer to the eye than the center, world units.
    [[nodiscard]] std::array<double, 3> project(const Vec3& world) const;
    /// The position at the center's depth that is projected to x, y.
    [[nodiscard]] Vec3 place(double x, double y) const;
};

/// A camera that shows the whole extent in `at` for a `zoom` of 1, which is an additional magnification.
/// @param margin  on each side, as a fraction of `at`
[[nodiscard]] Camera frame(const Basis& basis, const Extent& extent, const Rect& at, double margin, double zoom);

}  // namespace covol::figure
