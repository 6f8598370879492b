#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristics.h"

namespace covol {

/// The grids of the indicator function: indicator.cpp.
struct IndicatorHeuristics {
    /// [longest sides] Margin of the lattice around the points.
    double beyond = heuristic("indicator.beyond", 0.2);
    /// [cells] Minimum number along the longest side.
    int min_cells = heuristic("indicator.min_cells", 48);
    /// [spacings around a point] Maximum cell size there; sparser points use coarser grids.
    double local_cells = heuristic("indicator.local_cells", 0.5);
    /// [V-cycles] Of multigrid without an initial solution.
    int cycles_from_nothing = heuristic("indicator.cycles_from_nothing", 8);
};
COVOL_HEURISTICS IndicatorHeuristics kIndicator{};

/// Alternating updates of the normals and their indicator: iteration.cpp. The iteration follows Hou et al., Iterative
/// Poisson surface reconstruction (iPSR), ACM Trans. Graph. 41(4), 2022; the turning of patches is added here.
struct IterationHeuristics {
    /// [cells] Side of the patches over which the indicator is averaged.
    double patch_cells = heuristic("iteration.patch_cells", 2);
    /// [indicator] Deviation of a patch's mean from 1/2 from which on turning the patch is tried.
    double patch_off = heuristic("iteration.patch_off", 0.12);
    /// [rounds] Maximum number of rounds of turning patches.
    int patch_rounds = heuristic("iteration.patch_rounds", 4);
    /// [V-cycles] Of multigrid after each turning of patches.
    int patch_cycles = heuristic("iteration.patch_cycles", 2);
    /// [iterations] Updates of all normals after each round of turning patches.
    int after_turning = heuristic("iteration.after_turning", 3);
    /// [fraction of the points] In patches that stay turned, below which the rounds end: the remaining patches may
    /// alternate.
    double few_stayed = heuristic("iteration.few_stayed", 0.002);
    /// [1 - cosine] Mean change of the normals at which the iteration ends.
    double steady = heuristic("iteration.steady", 1e-4);
    /// [V-cycles] Of multigrid in each iteration.
    int cycles = heuristic("iteration.cycles", 1);
    /// [V-cycles] Of multigrid in the last iteration.
    int last_cycles = heuristic("iteration.last_cycles", 4);
};
COVOL_HEURISTICS IterationHeuristics kIteration{};

/// Repair of normals that are reversed or tangential to their sheet, for clouds without noise: torn.cpp.
struct TornHeuristics {
    /// [ratio] Of the smallest to the middle variance of the neighbours, above which they are not a sheet.
    double flat = heuristic("torn.flat", 0.06);
    /// [cosine] Between a normal and that of its sheet, below which it counts as tangential.
    double upright = heuristic("torn.upright", 0.5);
    /// [cosine] Minimum between the normals of sheets that continue each other.
    double same_sheet = heuristic("torn.same_sheet", 0.9);
};
COVOL_HEURISTICS TornHeuristics kTorn{};

/// Distinguishes a right orientation from a wrong one: consistency.cpp.
struct ConsistencyHeuristics {
    /// [iterations] In which normals adopt the indicator's direction without changing sides.
    int turns = heuristic("consistency.turns", 3);
};
COVOL_HEURISTICS ConsistencyHeuristics kConsistency{};

/// Area of the surface that a point represents: areas.h.
struct AreasHeuristics {
    /// [points] Number of nearest neighbours from whose distance the density follows.
    std::size_t neighbours = heuristic("areas.neighbours", 8);
};
COVOL_HEURISTICS AreasHeuristics kAreas{};

}  // namespace covol
