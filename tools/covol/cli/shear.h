#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>

#include "covol/image.h"

namespace covol::tool {

/// Maximum deviation of the angles between an image's axes from 90 degrees, in degrees. It is 0 if no cosine of these
/// angles exceeds 0.001, because the numbers in image files are rounded.
[[nodiscard]] inline double shear_of(const ImageGeometry& geometry) {
    constexpr double kRounding = 1e-3;
    const Matrix3& d = geometry.direction;
    double maximum = 0;
    for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < a; ++b)
            maximum = std::max(maximum, std::abs(d[0][a] * d[0][b] + d[1][a] * d[1][b] + d[2][a] * d[2][b]));
    return maximum > kRounding ? std::asin(std::min(1.0, maximum)) * 180 / std::numbers::pi : 0;
}

}  // namespace covol::tool
