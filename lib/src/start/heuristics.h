#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// Growing to the image's edges: grow.cpp. The front is that of Malladi, Sethian and Vemuri, Shape modeling with front
/// propagation, IEEE Trans. Pattern Anal. Mach. Intell. 17(2), 1995; the stopping criterion is not from there.
struct GrowHeuristics {
    /// [of the image's range] Differences below it are ignored.
    double min_spread = heuristic("grow.min_spread", 0.01);
    /// [fraction of the inside] With more voxels that are not similar to its surface, the start contains an object
    /// already.
    double unlike_fraction = heuristic("grow.unlike_fraction", 0.03);
    /// [of the speed without differences] Minimum speed of the front.
    double min_speed = heuristic("grow.min_speed", 1e-4);
    /// [of the best front's edge] A start whose edge is at least as strong lies at an edge already; once the front's
    /// edge is weaker, the front has left the best edge.
    double passed = heuristic("grow.passed", 0.5);
    /// [spreads] Minimum mean change across the front that is not caused by noise.
    double clear = heuristic("grow.clear", 0.3);
    /// [ratio] Of the volume of a front that has left the best edge to that of the best front, required in addition.
    double passed_growth = heuristic("grow.passed_growth", 2);
    /// [volumes of the region] Maximum of a cavity that the front has left out and that is filled.
    double small_cavity = heuristic("grow.small_cavity", 0.01);
};
COVOL_HEURISTICS GrowHeuristics kGrow{};

}  // namespace covol
