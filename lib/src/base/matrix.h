#pragma once
#include "covol/fwd.h"

namespace covol::detail {

inline double determinant(const Matrix3& m) {
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

/// The inverse by cofactors. The transpose would be inexact: direction cosines in a file are rounded to some digits.
inline Matrix3 inverse(const Matrix3& m) {
    Matrix3 cofactors{};
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
            const int a1 = (a + 1) % 3, a2 = (a + 2) % 3, b1 = (b + 1) % 3, b2 = (b + 2) % 3;
            cofactors[a][b] = m[a1][b1] * m[a2][b2] - m[a1][b2] * m[a2][b1];
        }
    const double det = m[0][0] * cofactors[0][0] + m[0][1] * cofactors[0][1] + m[0][2] * cofactors[0][2];
    Matrix3 result{};
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) result[a][b] = cofactors[b][a] / det;
    return result;
}

inline Vec3 multiply(const Matrix3& m, const Vec3& v) {
    Vec3 result{};
    for (int a = 0; a < 3; ++a) result[a] = m[a][0] * v[0] + m[a][1] * v[1] + m[a][2] * v[2];
    return result;
}

}  // namespace covol::detail
