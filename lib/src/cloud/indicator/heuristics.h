#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

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
    /// [fraction of the points, or of the area] That is not explained by noise.
    double some = heuristic("cloud.some", 0.02);
    /// [rounds] After sides of normals changed, until their directions agree with the indicator.
    int settling = heuristic("cloud.settling", 3);
};
COVOL_HEURISTICS CloudHeuristics kCloud{};

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
    /// [indicator] Deviation of a patch's mean from 1/2 from which on turning the patch is tried.
    double patch_off = heuristic("iteration.patch_off", 0.12);
    /// [V-cycles] Of multigrid after each turning of patches.
    int patch_cycles = heuristic("iteration.patch_cycles", 2);
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
    /// [cosine] Minimum between the normals of sheets that continue each other.
    double same_sheet = heuristic("torn.same_sheet", 0.9);
};
COVOL_HEURISTICS TornHeuristics kTorn{};

}  // namespace covol
