#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// The edge detector: edge.cpp.
struct EdgeHeuristics {
    /// [percentile] Percentile of the slopes from which K is chosen.
    double slope_percentile = heuristic("edge.slope_percentile", 0.9);
    /// [of the median brightness] Brightness of lines from which K is chosen, so that weaker lines still count.
    double line_fraction = heuristic("edge.line_fraction", 1.0 / 3.0);
    /// [of the voxels] Fraction of the voxels whose brightness becomes 1 because they are the brightest ones, and
    /// fraction of those whose brightness becomes 0 because they are the darkest ones.
    double clipped = heuristic("edge.clipped", 0.005);
};
COVOL_HEURISTICS EdgeHeuristics kEdge{};

}  // namespace covol
