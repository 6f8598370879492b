#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristic.h"

namespace covol {

/// The edge detector: edge.cpp.
struct EdgeHeuristics {
    /// [sigmas] Distance beyond which smoothing has no noticeable effect.
    double halo_sigmas = heuristic("edge.halo_sigmas", 3.0);
    /// [h²] Maximum time step of smoothing; shorter steps make the kernel more similar to a Gaussian.
    double largest_heat_step = heuristic("edge.largest_heat_step", 0.5);
    /// [percentile] Of the slopes, from which the contrast K is chosen.
    double slope_percentile = heuristic("edge.slope_percentile", 0.9);
    /// [percentile] Of the brightness of lines, from which K is chosen.
    double line_percentile = heuristic("edge.line_percentile", 0.5);
    /// [fraction of that brightness] Brightness from which K is chosen, so that weaker lines still count.
    double line_fraction = heuristic("edge.line_fraction", 1.0 / 3.0);
    /// [standard errors] Minimum strength of a line; a weaker one may be noise.
    double standard_errors = heuristic("edge.standard_errors", 3.0);
    /// [percentile] Of the brightness, that becomes 0.
    double low_percentile = heuristic("edge.low_percentile", 0.005);
    /// [percentile] Of the brightness, that becomes 1.
    double high_percentile = heuristic("edge.high_percentile", 0.995);
};
COVOL_HEURISTICS EdgeHeuristics kEdge{};

}  // namespace covol
