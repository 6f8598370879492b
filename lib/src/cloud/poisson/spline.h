#pragma once
// Cubic B-splines on the nodes around a position.
#include <array>
#include <cstdint>
#include <cstring>

namespace covol::cloud {

using Float4 = float __attribute__((vector_size(16)));

inline Float4 load4(const float* p) {
    Float4 v;
    std::memcpy(&v, p, sizeof v);
    return v;
}

inline double sum_of(Float4 v) { return double((v[0] + v[1]) + (v[2] + v[3])); }

/// Weights w of the four nodes around a position along each axis, and the derivatives d of these weights with respect
/// to the position in cells.
struct Spline {
    /// @param within  position in the cell, 0 to 1 along each axis
    explicit Spline(const std::array<double, 3>& within) {
        for (std::size_t a = 0; a < 3; ++a) {
            const auto t = float(within[a]), s = 1 - t;
            w[a] = Float4{s * s * s, 4 - 6 * t * t + 3 * t * t * t, 4 - 6 * s * s + 3 * s * s * s, t * t * t} / 6.0F;
            d[a] = 0.5F * Float4{-s * s, -4 * t + 3 * t * t, 4 * s - 3 * s * s, t * t};
        }
    }
    std::array<Float4, 3> w, d;
};

}  // namespace covol::cloud
