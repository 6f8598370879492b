#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include <cstddef>

#include "base/heuristic.h"

namespace covol {

/// The lattice of the indicator function: indicator.cpp.
struct IndicatorHeuristics {
    /// [longest sides] Of the lattice around the points.
    double beyond = heuristic("indicator.beyond", 0.2);
    /// [cells] Fewest along the longest side.
    int min_cells = heuristic("indicator.min_cells", 48);
    /// [spacings around a point] Largest cell there, above which its cells are those of a coarser grid.
    double local_cells = heuristic("indicator.local_cells", 0.5);
    /// [V-cycles] Of multigrid where nothing is known yet.
    int cycles_from_nothing = heuristic("indicator.cycles_from_nothing", 8);
};
COVOL_HEURISTICS IndicatorHeuristics kIndicator{};

/// Normals and their indicator, in turn: iteration.cpp. Hou et al., Iterative Poisson surface reconstruction (iPSR),
/// ACM Trans. Graph. 41(4), 2022, has the iteration; patches are ours.
struct IterationHeuristics {
    /// [cells] Edge of the patches over which the indicator is averaged.
    double patch_cells = heuristic("iteration.patch_cells", 2);
    /// [indicator] Distance from 1/2 of a patch's mean from which on it may be turned.
    double patch_off = heuristic("iteration.patch_off", 0.12);
    /// [rounds] Of turning patches.
    int patch_rounds = heuristic("iteration.patch_rounds", 4);
    /// [V-cycles] Of multigrid after each turn of patches.
    int patch_cycles = heuristic("iteration.patch_cycles", 2);
    /// [iterations] Of all normals once patches were turned.
    int after_turning = heuristic("iteration.after_turning", 3);
    /// [share of the points] In patches that stay turned: fewer, and those left may turn to and fro.
    double few_stayed = heuristic("iteration.few_stayed", 0.002);
    /// [1 - cosine] Mean change of the normals at which the iteration ends.
    double steady = heuristic("iteration.steady", 1e-4);
    /// [V-cycles] Of multigrid in an iteration.
    int cycles = heuristic("iteration.cycles", 1);
    /// [V-cycles] Of multigrid in the last one.
    int last_cycles = heuristic("iteration.last_cycles", 4);
};
COVOL_HEURISTICS IterationHeuristics kIteration{};

/// Normals turned over or lying in their sheet, where there is no noise: torn.cpp.
struct TornHeuristics {
    /// [ratio] Of the least variance of the neighbours to the middle one, above which they are no sheet.
    double flat = heuristic("torn.flat", 0.06);
    /// [cosine] Between a normal and its sheet's, below which it lies in the sheet.
    double upright = heuristic("torn.upright", 0.5);
    /// [cosine] Between normals of sheets that go on into each other.
    double same_sheet = heuristic("torn.same_sheet", 0.9);
};
COVOL_HEURISTICS TornHeuristics kTorn{};

/// What tells a right orientation from a wrong one: consistency.cpp.
struct ConsistencyHeuristics {
    /// [iterations] In which normals take the indicator's direction, each on its own side.
    int turns = heuristic("consistency.turns", 3);
};
COVOL_HEURISTICS ConsistencyHeuristics kConsistency{};

/// Area of the surface that a point stands for: areas.cpp.
struct AreasHeuristics {
    /// [points] Within whose distance the density is taken.
    std::size_t neighbours = heuristic("areas.neighbours", 8);
};
COVOL_HEURISTICS AreasHeuristics kAreas{};

}  // namespace covol
