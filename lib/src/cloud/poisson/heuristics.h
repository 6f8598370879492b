#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// Multigrid for the Poisson equation of the indicator: winding_field.cpp.
struct WindingFieldHeuristics {
    /// [sweeps] Gauss-Seidel sweeps before and after each correction.
    int sweeps = heuristic("winding_field.sweeps", 1);
    /// [sweeps] Gauss-Seidel sweeps on the coarsest grid, which is one block.
    int coarsest_sweeps = heuristic("winding_field.coarsest_sweeps", 32);
};
COVOL_HEURISTICS WindingFieldHeuristics kWinding{};

}  // namespace covol
