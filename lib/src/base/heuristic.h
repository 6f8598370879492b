#pragma once
// Heuristic constants: thresholds, factors and counts that were chosen by judgement or measurement and change results.
// Each folder keeps its own in heuristics.h, with one struct for each step; docs/heuristics.md shows the effect of
// halving and doubling each of them.
//
// In the build that measures this (-DCOVOL_SENSITIVITY=ON, never installed), each is multiplied at start-up by a factor
// from the environment: COVOL_SCALE="stray.far=2,local_fit.ridge=0.5".
#ifdef COVOL_SENSITIVITY
#include <algorithm>
#include <cmath>
#include <type_traits>

#define COVOL_HEURISTICS inline const
#else
#define COVOL_HEURISTICS inline constexpr
#endif

namespace covol {

#ifdef COVOL_SENSITIVITY
/// The factor that COVOL_SCALE gives for the name; 1 by default.
[[nodiscard]] double heuristic_scale(const char* name);

/// Counts are rounded, and at least 1.
template <typename T>
[[nodiscard]] T heuristic(const char* name, T value) {
    const double scaled = heuristic_scale(name) * double(value);
    if constexpr (std::is_integral_v<T>)
        return T(std::max(1LL, std::llround(scaled)));
    else
        return T(scaled);
}
#else
template <typename T>
[[nodiscard]] constexpr T heuristic(const char* /*name*/, T value) {
    return value;
}
#endif

}  // namespace covol
