#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// Principles that the steps of a cloud have in common.
struct CloudHeuristics {
    /// [spacings, noises or cells] Edge of coarse cells, in which about four points represent the surface without
    /// holes; and the distance from which on something is not beside a point.
    double coarse = heuristic("cloud.coarse", 2.0);
    /// [ratio] Of the distance from the plane of a sheet to the distance along it, up to which points are on the sheet.
    double flat = heuristic("cloud.flat", 0.25);
    /// [fraction of the points] That is explained by single points.
    double few = heuristic("cloud.few", 0.002);
    /// [fraction of the points, of the area, or of the indicator's step] That is not explained by noise: orientations
    /// of closed shapes have less, those of scans of one side more. Their doubt is up to 0.013 and from 0.026 on, their
    /// area without points below 0.01 and from 0.14 on.
    double some = heuristic("cloud.some", 0.02);
    /// [iterations] After sides of normals changed, until their directions agree with the indicator.
    int settling = heuristic("cloud.settling", 3);
};
COVOL_HEURISTICS CloudHeuristics kCloud{};

/// The grids of the indicator function: indicator.cpp.
struct IndicatorHeuristics {
    /// [longest sides] Margin of the lattice around the points.
    double beyond = heuristic("indicator.beyond", 0.2);
    /// [cells] Minimum number along the longest side.
    int min_cells = heuristic("indicator.min_cells", 48);
    /// [spacings around a point] Maximum cell size there, since sparser points use coarser grids; and the minimum cell
    /// of any attempt, since smaller cells show single points.
    double local_cells = heuristic("indicator.local_cells", 0.5);
};
COVOL_HEURISTICS IndicatorHeuristics kIndicator{};

/// Alternating updates of the normals and their indicator: iteration.cpp. The iteration follows Hou et al., Iterative
/// Poisson surface reconstruction (iPSR), ACM Trans. Graph. 41(4), 2022; the turning of patches is added here.
struct IterationHeuristics {
    /// [iterations] Maximum number of updates of all normals on one lattice.
    int updates = heuristic("iteration.updates", 10);
    /// [indicator] Deviation of a patch's mean from 1/2 from which on turning the patch is tried.
    double patch_off = heuristic("iteration.patch_off", 0.12);
    /// [V-cycles] Of multigrid after a change of sides.
    int patch_cycles = heuristic("iteration.patch_cycles", 2);
};
COVOL_HEURISTICS IterationHeuristics kIteration{};

}  // namespace covol
