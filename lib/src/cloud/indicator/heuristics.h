#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristics.h"

namespace covol {

/// Constants that several steps of the reconstruction from clouds have in common.
struct CloudHeuristics {
    /// [spacings, noises or cells] Edge of coarse cells: about four points of a surface are in each, so that hardly any
    /// cell that the surface crosses is empty. Also the distance beyond which a position is not next to a point.
    double coarse = heuristic("cloud.coarse", 2.0);
    /// [ratio] Maximum ratio of the distances of points from a sheet to the radius of their neighbourhood, for points
    /// of the sheet.
    double flat = heuristic("cloud.flat", 0.25);
    /// [cosine] Minimum between the normals of two parts of one sheet; with a smaller one, they meet in a crease.
    double same_sheet = heuristic("cloud.same_sheet", 0.9);
    /// [fraction of the points] Fraction below which deviations are attributed to single points.
    double few = heuristic("cloud.few", 0.002);
    /// [fraction of the points, or of the area] Fraction above which deviations are not attributed to noise.
    double some = heuristic("cloud.some", 0.02);
    /// [rounds] Number of updates after normals were reversed, until their directions agree with the indicator again;
    /// maximum number of rounds that reverse single normals or remove stray points.
    int settling = heuristic("cloud.settling", 3);
};
COVOL_HEURISTICS CloudHeuristics kCloud{};

/// The grids of the indicator function: indicator.cpp.
struct IndicatorHeuristics {
    /// [cells] Minimum number of cells along the longest side.
    int min_cells = heuristic("indicator.min_cells", 48);
    /// [square roots of the area that a point represents] Maximum cell size at the point, unless the finest grid is
    /// coarser: the coarsest grid within this limit is used, so that sparser points have coarser grids.
    double local_cells = heuristic("indicator.local_cells", 0.5);
    /// [V-cycles] Number of multigrid cycles for a solution without a close initial value.
    int cycles_from_nothing = heuristic("indicator.cycles_from_nothing", 8);
};
COVOL_HEURISTICS IndicatorHeuristics kIndicator{};

/// Alternating updates of the normals and their indicator: iteration.cpp. The iteration follows Hou et al., Iterative
/// Poisson surface reconstruction (iPSR), ACM Trans. Graph. 41(4), 2022; the reversal of whole patches is added here.
struct IterationHeuristics {
    /// [indicator] Deviation of a cell's mean indicator from 1/2 from which on the cell belongs to a patch whose
    /// normals are reversed on trial.
    double patch_off = heuristic("iteration.patch_off", 0.12);
    /// [V-cycles] Number of multigrid cycles in each update while patches are reversed.
    int patch_cycles = heuristic("iteration.patch_cycles", 2);
    /// [1 - cosine] Mean change of the normals below which the iteration ends.
    double steady = heuristic("iteration.steady", 1e-4);
    /// [V-cycles] Number of multigrid cycles in the last iteration.
    int last_cycles = heuristic("iteration.last_cycles", 4);
};
COVOL_HEURISTICS IterationHeuristics kIteration{};

}  // namespace covol
