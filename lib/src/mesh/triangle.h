#pragma once
// Geometry of triangles from the positions of their corners.
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "covol/error.h"
#include "covol/fwd.h"

namespace covol::meshing {

using Position = std::array<float, 3>;
using Positions = std::vector<Position>;
using Triangle = std::array<std::uint32_t, 3>;

inline Vec3 to_vec3(const Position& p) { return {p[0], p[1], p[2]}; }
inline Position to_position(const Vec3& p) { return {float(p[0]), float(p[1]), float(p[2])}; }

/// The number of corners of `triangles` triangles. @throws Error Unsupported if 32 bits are not enough to number them.
inline std::uint32_t corner_count(std::uint64_t triangles) {
    constexpr std::uint64_t kMax = (~std::uint32_t(0)) / 3;
    if (triangles > kMax)
        throw Error(Errc::Unsupported, "expected at most " + std::to_string(kMax) + " triangles, got " +
                                           std::to_string(triangles) + "; use a larger voxel size");
    return static_cast<std::uint32_t>(3 * triangles);
}

/// Six times the signed volume of the tetrahedron of a triangle and `origin`.
inline double six_volumes(const std::array<Vec3, 3>& p, const Vec3& origin) {
    return dot(minus(p[0], origin), cross(minus(p[1], origin), minus(p[2], origin)));
}

/// The outward normal, whose length is twice the area.
inline Vec3 area_normal(const Vec3& a, const Vec3& b, const Vec3& c) { return cross(minus(b, a), minus(c, a)); }
inline Vec3 area_normal(const Positions& p, const Triangle& t) {
    return area_normal(to_vec3(p[t[0]]), to_vec3(p[t[1]]), to_vec3(p[t[2]]));
}

inline double area(const Vec3& a, const Vec3& b, const Vec3& c) { return length(area_normal(a, b, c)) / 2; }

/// The cosine of the smallest angle of a triangle, 1 for a degenerate triangle: the smaller the cosine, the better the
/// shape.
inline double worst_cosine(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 side[3] = {minus(c, b), minus(a, c), minus(b, a)};
    double size[3];
    for (int k = 0; k < 3; ++k) size[k] = length(side[k]);
    double worst = -1;
    for (int k = 0; k < 3; ++k) {
        const double product = size[(k + 1) % 3] * size[(k + 2) % 3];
        worst = std::max(worst, product > 0 ? -dot(side[(k + 1) % 3], side[(k + 2) % 3]) / product : 1.0);
    }
    return worst;
}

}  // namespace covol::meshing
