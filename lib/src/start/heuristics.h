#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// Growing to the image's edges: grow.cpp. The front is that of Malladi, Sethian and Vemuri, Shape modeling with front
/// propagation, IEEE Trans. Pattern Anal. Mach. Intell. 17(2), 1995; the stopping criterion differs.
struct GrowHeuristics {
    /// [spreads] Minimum mean change across the front, relative to the spread of the image inside the start, for an
    /// edge.
    double clear = heuristic("grow.clear", 0.3);
};
COVOL_HEURISTICS GrowHeuristics kGrow{};

}  // namespace covol
