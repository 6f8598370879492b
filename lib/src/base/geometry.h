#pragma once
// Vector algebra.
#include <array>
#include <cmath>

#include "covol/domain.h"

namespace covol {

inline double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vec3 minus(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vec3 plus(const Vec3& a, const Vec3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
/// a + s b
inline Vec3 plus(const Vec3& a, double s, const Vec3& b) { return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]}; }
inline Vec3 times(double s, const Vec3& a) { return {s * a[0], s * a[1], s * a[2]}; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Vec3& a) { return std::sqrt(dot(a, a)); }
/// The unit vector in the direction of v; 0 if v is 0.
inline Vec3 unit(const Vec3& v) {
    const double size = length(v);
    return size > 1e-30 ? times(1 / size, v) : Vec3{0, 0, 0};
}

inline std::array<Vec3, 8> corners(const WorldBox& box) {
    std::array<Vec3, 8> all{};
    for (int c = 0; c < 8; ++c)
        all[c] = {(c & 1) != 0 ? box.max[0] : box.min[0], (c & 2) != 0 ? box.max[1] : box.min[1],
                  (c & 4) != 0 ? box.max[2] : box.min[2]};
    return all;
}

}  // namespace covol
