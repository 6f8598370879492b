#pragma once
// Parallel projection: how places of the world come onto the picture.
#include <array>
#include <vector>

#include "covol/domain.h"
#include "render/draw/canvas.h"

namespace covol::figure {

/// Where the picture's axes point in the world; unit vectors.
struct Basis {
    Vec3 right, up, to_eye;
};

/// Azimuth 0 looks from the front, along +y, and 90 from +x; elevation 90 from above, along -z. Degrees.
[[nodiscard]] Basis look(double azimuth, double elevation);

/// How far something reaches along a basis' axes, world units.
struct Extent {
    double min[3] = {1e300, 1e300, 1e300}, max[3] = {-1e300, -1e300, -1e300};
    void add(double right, double up, double to_eye);
    void add(const Extent& other);
    [[nodiscard]] double size(int axis) const { return max[axis] - min[axis]; }
};

/// A view of the world in a part of the picture.
struct Camera {
    Basis basis;
    Vec3 center;       ///< world; it is seen in the middle of `at`
    double pixel = 1;  ///< world units
    Rect at;

    /// x and y on the picture, pixels, and how much closer to the eye than the center, world units.
    [[nodiscard]] std::array<double, 3> project(const Vec3& world) const;
    /// The place at the center's depth that is seen at x, y.
    [[nodiscard]] Vec3 place(double x, double y) const;
};

/// What reaches so far is seen whole in `at`, with a margin of that share, `zoom` times as large.
[[nodiscard]] Camera frame(const Basis& basis, const Extent& extent, const Rect& at, double margin, double zoom);

}  // namespace covol::figure
