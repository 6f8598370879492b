#pragma once
// Half-spaces, and directions along and perpendicular to their planes.
#include <array>
#include <cmath>

#include "base/geometry.h"
#include "covol/clip.h"

namespace covol::detail {

/// n·x - offset: signed distance of a position from the plane, negative in the half-space.
[[nodiscard]] inline double along(const HalfSpace& plane, const Vec3& x) { return dot(plane.normal, x) - plane.offset; }

[[nodiscard]] inline Vec3 moved(const Vec3& x, const Vec3& direction, double by) {
    return plus(x, times(by, direction));
}

/// The nearest position in the clip, found by projecting onto its planes in turn; exact for a box.
[[nodiscard]] inline Vec3 projected(const Clip& clip, Vec3 x) {
    constexpr int kProjections = 8;
    for (int round = 0; round < kProjections; ++round) {
        bool any = false;
        for (const HalfSpace& plane : clip) {
            const double beyond = along(plane, x);
            if (!(beyond > 0)) continue;
            for (int a = 0; a < 3; ++a) x[a] -= beyond * plane.normal[a];
            any = true;
        }
        if (!any) break;
    }
    return x;
}

/// Two unit vectors in the plane that are perpendicular to each other. If the plane is parallel to two of the world's
/// axes, the vectors are these axes.
[[nodiscard]] inline std::array<Vec3, 2> directions_in(const HalfSpace& plane) {
    const Vec3& n = plane.normal;
    int across = 0;
    for (int a = 1; a < 3; ++a)
        if (std::abs(n[a]) > std::abs(n[across])) across = a;
    std::array<Vec3, 2> found;
    for (int i = 0, a = 0; a < 3; ++a) {
        if (a == across) continue;
        Vec3 direction{0, 0, 0};
        direction[a] = 1;
        direction = moved(direction, n, -n[a]);
        if (i == 1) direction = moved(direction, found[0], -dot(direction, found[0]));
        found[i++] = unit(direction);
    }
    return found;
}

}  // namespace covol::detail
