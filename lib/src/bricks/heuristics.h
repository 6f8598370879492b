#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include "base/heuristic.h"

namespace covol {

struct BricksHeuristics {
    /// [voxels] Most across the points, on the lattice of the coarse solve.
    double coarse_voxels = heuristic("bricks.coarse_voxels", 400.0);
    /// [voxels] Least size of that lattice's voxels.
    double least_factor = heuristic("bricks.least_factor", 2.0);
    /// [coarse leaves] At so many the image's edges are looked at, before bricks are solved, to fix what g means.
    double edge_samples = heuristic("bricks.edge_samples", 64.0);
};
COVOL_HEURISTICS BricksHeuristics kBricks{};

}  // namespace covol
