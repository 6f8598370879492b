#include "render/draw/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/geometry.h"

namespace covol::figure {

Basis view_basis(double azimuth, double elevation) {
    const double a = azimuth * std::numbers::pi / 180, e = elevation * std::numbers::pi / 180;
    Basis basis;
    basis.to_eye = {std::sin(a) * std::cos(e), -std::cos(a) * std::cos(e), std::sin(e)};
    basis.right = {std::cos(a), std::sin(a), 0};
    basis.up = cross(basis.to_eye, basis.right);
    return basis;
}

void Extent::add(double right, double up, double to_eye) {
    const double at[3] = {right, up, to_eye};
    for (int a = 0; a < 3; ++a) {
        min[a] = std::min(min[a], at[a]);
        max[a] = std::max(max[a], at[a]);
    }
}

void Extent::add(const Extent& other) {
    for (int a = 0; a < 3; ++a) {
        min[a] = std::min(min[a], other.min[a]);
        max[a] = std::max(max[a], other.max[a]);
    }
}

std::array<double, 3> Camera::project(const Vec3& world) const {
    const Vec3 away = minus(world, center);
    return {at.x + 0.5 * at.width + dot(away, basis.right) / pixel,
            at.y + 0.5 * at.height - dot(away, basis.up) / pixel, dot(away, basis.to_eye)};
}

Vec3 Camera::place(double x, double y) const {
    return plus(center, plus(times(pixel * (x - at.x - 0.5 * at.width), basis.right),
                             times(pixel * (at.y + 0.5 * at.height - y), basis.up)));
}

Camera frame(const Basis& basis, const Extent& extent, const Rect& at, double margin, double zoom) {
    Camera camera{basis, {0, 0, 0}, 1, at};
    const Vec3 axes[3] = {basis.right, basis.up, basis.to_eye};
    for (int a = 0; a < 3; ++a)
        camera.center = plus(camera.center, times(0.5 * (extent.min[a] + extent.max[a]), axes[a]));
    const double largest = std::max(extent.size(0) / at.width, extent.size(1) / at.height);
    camera.pixel = std::max(largest, 1e-12 * std::max(1.0, extent.size(2))) / ((1 - 2 * margin) * zoom);
    return camera;
}

}  // namespace covol::figure
