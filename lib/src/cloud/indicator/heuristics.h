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
    /// [fraction of the points] Fraction below which points that were reversed or removed, contradict the indicator of
    /// all points, or form a separate piece, count as exceptions.
    double few = heuristic("cloud.few", 0.002);
    /// [rounds] Number of updates of indicator and normals after normals were reversed, until both agree again. Also
    /// the maximum number of rounds that reverse single normals or remove stray points.
    int settling = heuristic("cloud.settling", 3);
};
COVOL_HEURISTICS CloudHeuristics kCloud{};

/// The grids of the indicator function: indicator.cpp.
struct IndicatorHeuristics {
    /// [cells] Minimum number of cells along the longest side of the box in which the indicator is computed.
    int min_cells = heuristic("indicator.min_cells", 48);
    /// [square roots of the area that a point represents] Maximum cell size at the point, unless the finest grid is
    /// coarser: the coarsest grid within this limit is used, so that sparser points have coarser grids.
    double local_cells = heuristic("indicator.local_cells", 0.5);
};
COVOL_HEURISTICS IndicatorHeuristics kIndicator{};

/// Alternating updates of the normals and their indicator: iteration.cpp. The iteration follows Hou et al., Iterative
/// Poisson surface reconstruction (iPSR), ACM Trans. Graph. 41(4), 2022; the reversal of whole patches is added here.
struct IterationHeuristics {
    /// [indicator] Deviation of a cell's mean indicator from 1/2 from which on the cell belongs to a patch whose
    /// normals are reversed tentatively.
    double patch_off = heuristic("iteration.patch_off", 0.12);
    /// [V-cycles] Number of multigrid cycles for each solution while patches are reversed tentatively: few, because the
    /// solution for the previous normals is the initial value.
    int patch_cycles = heuristic("iteration.patch_cycles", 2);
    /// [1 - cosine] Mean change of the normals in one update, below which the updates end.
    double steady = heuristic("iteration.steady", 1e-4);
    /// [V-cycles] Number of multigrid cycles in the last update, and after the repair of normals by repair_torn().
    int last_cycles = heuristic("iteration.last_cycles", 4);
};
COVOL_HEURISTICS IterationHeuristics kIteration{};

}  // namespace covol
