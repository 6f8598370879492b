#pragma once
// Lighting of surfaces.
#include <cmath>

#include "base/geometry.h"
#include "render/draw/camera.h"
#include "render/draw/color.h"

namespace covol::figure {

/// A key light from the viewer's upper left, a weaker light from the right, and ambient light; a wide and faint
/// highlight. Parts whose normals turn away from the eye are darker.
struct Lights {
    explicit Lights(const Basis& basis)
        : to_eye(basis.to_eye),
          key(unit(direction(basis, -0.55, 0.75, 1.0))),
          fill(unit(direction(basis, 1.0, -0.1, 0.7))),
          half(unit(plus(key, to_eye))) {}

    static constexpr double kAmbient = 0.34, kKey = 0.64, kFill = 0.16, kShine = 0.10, kGloss = 30, kRim = 0.25;

    /// @param normal  unit vector on the side of the surface that faces the eye
    [[nodiscard]] Color shade(const Color& color, const Vec3& normal) const {
        const double light =
            kAmbient + kKey * std::max(0.0, dot(normal, key)) + kFill * std::max(0.0, dot(normal, fill));
        const double facing = std::max(0.0, dot(normal, to_eye));
        const double rim = 1 - kRim * std::pow(1 - facing, 3);
        const double shine = kShine * std::pow(std::max(0.0, dot(normal, half)), kGloss);
        return sum(scaled(color, light * rim), gray(shine));
    }

    Vec3 to_eye, key, fill, half;

private:
    static Vec3 direction(const Basis& basis, double right, double up, double to_eye) {
        return plus(times(right, basis.right), plus(times(up, basis.up), times(to_eye, basis.to_eye)));
    }
};

}  // namespace covol::figure
