#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include "base/heuristic.h"

namespace covol {

/// The edge detector: edge.cpp.
struct EdgeHeuristics {
    /// [sigmas] Beyond it smoothing carries nothing worth computing.
    double halo_sigmas = heuristic("edge.halo_sigmas", 3.0);
    /// [h²] Shorter steps make the kernel rounder, more like a Gaussian.
    double largest_heat_step = heuristic("edge.largest_heat_step", 0.5);
    /// [percentile] Of the slopes that the contrast K is chosen from.
    double slope_percentile = heuristic("edge.slope_percentile", 0.9);
    /// [percentile] Of the lines at marks that K is chosen from.
    double line_percentile = heuristic("edge.line_percentile", 0.5);
    /// [of that strength] A line that weak still counts.
    double line_fraction = heuristic("edge.line_fraction", 1.0 / 3.0);
    /// [standard errors] A line weaker than that may be noise.
    double standard_errors = heuristic("edge.standard_errors", 3.0);
    /// [percentile] Of the brightness that becomes 0.
    double low_percentile = heuristic("edge.low_percentile", 0.005);
    /// [percentile] Of the brightness that becomes 1.
    double high_percentile = heuristic("edge.high_percentile", 0.995);
};
COVOL_HEURISTICS EdgeHeuristics kEdge{};

}  // namespace covol
