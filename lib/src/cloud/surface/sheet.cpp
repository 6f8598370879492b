#include "cloud/surface/sheet.h"

#include <cmath>

#include "base/geometry.h"

namespace covol::cloud {

std::array<Vec3, 3> frame_of(const Vec3& normal) {
    int smallest = 0;
    for (int a = 1; a < 3; ++a)
        if (std::abs(normal[a]) < std::abs(normal[smallest])) smallest = a;
    Vec3 other{0, 0, 0};
    other[smallest] = 1;
    const Vec3 u = unit(cross(normal, other));
    return {u, cross(normal, u), normal};
}

double Sheet::distance(const Vec3& world) const {
    const Vec3 to = minus(world, origin);
    const double u = dot(to, axes[0]), v = dot(to, axes[1]), t = dot(to, axes[2]);
    const double height = c[0] + u * (c[1] + u * c[3] + v * c[4]) + v * (c[2] + v * c[5]);
    const double du = c[1] + 2 * u * c[3] + v * c[4], dv = c[2] + 2 * v * c[5] + u * c[4];
    return (t - height) / std::sqrt(1 + du * du + dv * dv);
}

Vec3 Sheet::normal(const Vec3& world) const {
    const Vec3 to = minus(world, origin);
    const double u = dot(to, axes[0]), v = dot(to, axes[1]);
    const double du = c[1] + 2 * u * c[3] + v * c[4], dv = c[2] + 2 * v * c[5] + u * c[4];
    return unit(plus(plus(axes[2], -du, axes[0]), -dv, axes[1]));
}

double Sheet::curvature() const {
    // The larger absolute eigenvalue of the Hessian [2 c3, c4; c4, 2 c5], since the slope at the foot is small.
    const double mean = c[3] + c[5];
    return std::abs(mean) + std::hypot(c[3] - c[5], c[4]);
}

Vec3 Sheet::foot() const { return plus(origin, c[0], axes[2]); }

std::size_t Crease::nearest(const Vec3& world) const {
    std::size_t best = count - 1;
    double distance = sheets[best].distance(world);
    for (std::size_t n = count - 1; n-- > 0;) {
        const double other = sheets[n].distance(world);
        if ((n == 0 ? first_is_convex : others_are_convex) == (other > distance)) {
            best = n;
            distance = other;
        }
    }
    return best;
}

double Crease::distance(const Vec3& world) const { return sheets[nearest(world)].distance(world); }

unsigned Crease::sheets_at(const Vec3& world, double within) const {
    double value = sheets[count - 1].distance(world);
    unsigned found = 1U << (count - 1);
    for (std::size_t n = count - 1; n-- > 0;) {
        const double other = sheets[n].distance(world);
        const bool is_other = (n == 0 ? first_is_convex : others_are_convex) == (other > value);
        if (std::abs(other - value) <= within)
            found |= 1U << n;
        else if (is_other)
            found = 1U << n;
        if (is_other) value = other;
    }
    return found;
}

Vec3 Crease::mean_normal() const {
    Vec3 sum{0, 0, 0};
    for (std::size_t n = 0; n < count; ++n) sum = plus(sum, sheets[n].axes[2]);
    return unit(sum);
}

}  // namespace covol::cloud
