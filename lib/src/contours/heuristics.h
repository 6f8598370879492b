#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// Slices of contours: contours.cpp.
struct ContoursHeuristics {
    /// [count] Approximate maximum of marks along contours in planes of several directions.
    double network_marks = limit("contours.network_marks", 1500);
    /// [count] If contours lie in planes of several directions: maximum number of seeds inside, and of seeds outside,
    /// that are taken from each plane.
    double network_discs = limit("contours.network_discs", 64);
};
COVOL_HEURISTICS ContoursHeuristics kContours{};

}  // namespace covol
