#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristics.h"

namespace covol {

/// Search for the nearest neighbours of each point: neighbours.h.
struct NeighboursHeuristics {
    /// [spacings] Initial search radius; affects the time, not the result.
    double first_radius = limit("neighbours.first_radius", 2);
    /// [spacings] Radius above which the search radius is not doubled again, even if there are too few neighbours.
    double max_radius = limit("neighbours.max_radius", 40);
};
COVOL_HEURISTICS NeighboursHeuristics kNear{};

/// Distance to the nearest point: spacing.cpp.
struct SpacingHeuristics {
    /// [points] Maximum number of points whose distance to the nearest other point is measured. It is larger than
    /// common.sample because other lengths are multiples of the median of these distances.
    std::size_t queries = limit("spacing.queries", 50000);
};
COVOL_HEURISTICS SpacingHeuristics kPointSpacing{};

/// Scans with noise larger than the spacing of their points: scan_noise.cpp.
struct ScanNoiseHeuristics {
    /// [voxels] Maximum mean distance of points from the local plane at which a voxel size is large enough for the
    /// layer of points to appear as one surface.
    double thin_fraction = heuristic("scan_noise.thin_fraction", 0.35);
    /// [voxels] Radius of the neighbourhood to which the local plane is fitted, in voxels of the size that is tested.
    double plane_voxels = heuristic("scan_noise.plane_voxels", 2.5);
    /// [passes] Number of times that average_layers() projects all points onto local planes.
    int passes = heuristic("scan_noise.passes", 2);
};
COVOL_HEURISTICS ScanNoiseHeuristics kScan{};

}  // namespace covol
