#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// Growing to the image's edges: grow.cpp. The front is that of Malladi, Sethian and Vemuri, Shape modeling with front
/// propagation, IEEE Trans. Pattern Anal. Mach. Intell. 17(2), 1995; the stopping criterion is not from there.
struct GrowHeuristics {
    /// [of the best front's edge] A start whose edge is at least as strong lies at an edge already; once the front's
    /// edge is weaker, the front has left the best edge.
    double passed = heuristic("grow.passed", 0.5);
    /// [spreads] Minimum mean change across the front that is not caused by noise.
    double clear = heuristic("grow.clear", 0.3);
};
COVOL_HEURISTICS GrowHeuristics kGrow{};

}  // namespace covol
