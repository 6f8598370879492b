#pragma once
// Heuristic constants: thresholds, factors and counts that were chosen by judgement or measurement and change results.
// Each folder keeps its own in heuristics.h, with one struct for each step; docs/heuristics.md shows the effect of
// halving and doubling each of them.
//
// In the build that measures this effect (-DCOVOL_SENSITIVITY=ON, never installed), each constant is multiplied at
// start-up by the factor for its name in the environment variable COVOL_SCALE, for example
// COVOL_SCALE="stray.far=2,local_fit.ridge=0.5".
#include <cstddef>

#include "covol/domain.h"

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

/// The constant, multiplied by the factor for its name. Integer constants are rounded, and remain at least 1.
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

/// Distance in voxels by which a surface is continued beyond a cut, so that its band is correct up to the cut.
inline constexpr double kBeyondVoxels = 2 * kHalfWidthVoxels;

/// Constants that all steps have in common: samples, neighbourhoods, significance, repetition and margins.
struct CommonHeuristics {
    /// [points] Size of a sample from which a median, a mean or a fraction is estimated: the standard error is below
    /// 2 %. Also the maximum number of points for steps whose time grows with its square.
    std::size_t sample = limit("common.sample", 4000);
    /// [points] Number of nearest neighbours that represent the surroundings of a point on a surface: about as many as
    /// a vertex of a mesh has.
    std::size_t ring = heuristic("common.ring", 8);
    /// [points] Minimum number to which a plane or a quadric is fitted: twice the number of unknowns of a quadric.
    std::size_t quadric = heuristic("common.quadric", 12);
    /// [standard errors] Deviation of a measured value above which it is not attributed to chance.
    double errors = heuristic("common.errors", 4.0);
    /// [rounds] Maximum number of repetitions of a step that is repeated until it changes nothing: a repair, a
    /// reweighted fit, the computation of a body from marks and image.
    int rounds = heuristic("common.rounds", 4);
    /// [ratio] Factor between successive lengths in the search for a suitable scale: sqrt(2), so that areas double.
    double growth = heuristic("common.growth", 1.4142135623730951);
    /// [ratio] Margin around points, contours or a body, relative to their longest side.
    double margin = heuristic("common.margin", 0.2);
    /// [voxels] Precision of a position that is given by voxels, and thus the smallest length that has to be resolved.
    double precision_voxels = heuristic("common.precision_voxels", 0.5);
    /// [ratio] Maximum distance between two positions that count as equal, relative to the voxel size or to another
    /// length of the problem.
    double same_place = heuristic("common.same_place", 1e-3);
    /// [ratio] Minimum ratio between two lengths or sizes of which one counts as clearly larger than the other.
    double clear_ratio = heuristic("common.clear_ratio", 2.0);
    /// [fraction] Part of a whole below which it is negligible.
    double negligible = heuristic("common.negligible", 0.02);
    /// [fraction] Part of a whole below which it counts as an exception; two quantities also count as equal if they
    /// differ by a smaller fraction.
    double minority = heuristic("common.minority", 0.1);
    /// [cosine] Minimum cosine of an angle, which is at most 60 degrees: between the normals of a triangle before and
    /// after a change, between the normals of neighbouring sheets, and between a path that leaves a surface and the
    /// surface's normal.
    double turn = heuristic("common.turn", 0.5);
};
COVOL_HEURISTICS CommonHeuristics kCommon{};

}  // namespace covol
