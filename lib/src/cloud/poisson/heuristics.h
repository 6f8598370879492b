#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include "base/heuristic.h"

namespace covol {

/// Multigrid for the Poisson equation of the indicator: winding_field.cpp.
struct WindingFieldHeuristics {
    /// [sweeps] Of Gauss-Seidel before and after each correction.
    int sweeps = heuristic("winding_field.sweeps", 1);
    /// [sweeps] On the coarsest grid, a block.
    int coarsest_sweeps = heuristic("winding_field.coarsest_sweeps", 32);
};
COVOL_HEURISTICS WindingFieldHeuristics kWinding{};

}  // namespace covol
