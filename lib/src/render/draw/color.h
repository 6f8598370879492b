#pragma once
// Colours of figures, which colour-blind readers can distinguish too.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace covol::figure {

/// Red, green and blue in [0,1]: the bytes of a picture divided by 255.
using Color = std::array<float, 3>;

inline Color gray(double v) { return {float(v), float(v), float(v)}; }
inline Color mix(const Color& a, const Color& b, double fraction) {
    const auto t = float(fraction);
    return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
}
inline Color scaled(const Color& c, double by) { return {float(by * c[0]), float(by * c[1]), float(by * c[2])}; }
inline Color sum(const Color& a, const Color& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Color to_color(const std::array<std::uint8_t, 3>& c) {
    return {float(c[0]) / 255, float(c[1]) / 255, float(c[2]) / 255};
}

/// Colours of the palette of Okabe and Ito, Color universal design (2008).
inline constexpr Color kSkyBlue{0.337F, 0.706F, 0.914F}, kVermillion{0.835F, 0.369F, 0.0F}, kGreen{0.0F, 0.62F, 0.451F},
    kBlue{0.0F, 0.447F, 0.698F};

/// Colours of the background, of texts, and of less important texts.
struct Theme {
    Color background, ink, faint;
};
inline Theme theme(bool white) {
    return white ? Theme{gray(1), gray(0.08), gray(0.45)} : Theme{gray(0), gray(0.95), gray(0.62)};
}

}  // namespace covol::figure
