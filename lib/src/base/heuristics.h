#pragma once
// Heuristic constants: thresholds, factors and counts that were chosen by judgement or measurement and change results.
// Each folder keeps its own in heuristics.h, with one struct for each step; docs/heuristics.md shows the effect of
// halving and doubling each of them.
//
// In the build that measures this (-DCOVOL_SENSITIVITY=ON, never installed), each is multiplied at start-up by a factor
// from the environment: COVOL_SCALE="stray.far=2,local_fit.ridge=0.5".
#include <cstddef>

#ifdef COVOL_SENSITIVITY
#include <algorithm>
#include <cmath>
#include <type_traits>

#define COVOL_HEURISTICS inline const
#define COVOL_CONSTANT inline
#else
#define COVOL_HEURISTICS inline constexpr
#define COVOL_CONSTANT constexpr
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

/// A limit of time or memory: only inputs that reach it get a different result.
template <typename T>
[[nodiscard]] COVOL_CONSTANT T limit(const char* name, T value) {
    return heuristic(name, value);
}

/// Principles that all steps share: samples, neighbourhoods, significance, repetition and margins.
struct CommonHeuristics {
    /// [points] Sample from which a median, a mean or a fraction is estimated: its standard error is below 2 %. Also
    /// the maximum for steps whose time grows with the square of the number.
    std::size_t sample = heuristic("common.sample", 4000);
    /// [points] Nearest neighbours that show what is around a point of a surface: about one ring.
    std::size_t ring = heuristic("common.ring", 8);
    /// [points] Minimum to which a plane or a quadric is fitted: twice as many as a quadric has unknowns.
    std::size_t quadric = heuristic("common.quadric", 12);
    /// [standard errors] Difference from which on a measured value is not explained by chance.
    double errors = heuristic("common.errors", 4.0);
    /// [rounds] Maximum number in which a step is repeated until it changes nothing: a repair, a reweighted fit, the
    /// body of marks and image.
    int rounds = heuristic("common.rounds", 4);
    /// [ratio] Of a length to the one before it when a suitable scale is searched: an area doubles.
    double growth = heuristic("common.growth", 1.4142135623730951);
    /// [voxels] By which a surface is continued beyond the place where it is cut, so that its band is right up to
    /// there: twice the half width of a band.
    double beyond_voxels = heuristic("common.beyond_voxels", 6.0);
    /// [voxels] Precision of a position that is given by voxels, and thus the smallest length that has to be resolved.
    double precision_voxels = heuristic("common.precision_voxels", 0.5);
    /// [ratio] Of a distance to the relevant length, below which two positions are the same one.
    double same_place = heuristic("common.same_place", 1e-3);
    /// [ratio] From which on one length or size is clearly larger than another.
    double clear_ratio = heuristic("common.clear_ratio", 2.0);
    /// [fraction] Of a whole, that is negligible.
    double negligible = heuristic("common.negligible", 0.02);
    /// [fraction] Of a whole, that is a small part of it: exceptions are fewer, and two things that differ by less
    /// count as equal.
    double minority = heuristic("common.minority", 0.1);
    /// [cosine] Minimum between the normals of a triangle before and after a change, of neighbouring sheets, and
    /// between a path that leaves a surface and its normal: 60 degrees.
    double turn = heuristic("common.turn", 0.5);
};
COVOL_HEURISTICS CommonHeuristics kCommon{};

}  // namespace covol
