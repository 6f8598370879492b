#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristics.h"

namespace covol {

/// Search for the nearest neighbours of each point: neighbours.h.
struct NeighboursHeuristics {
    /// [spacings] Initial search radius; affects the time, not the result.
    double first_radius = limit("neighbours.first_radius", 2);
    /// [spacings] Search radius at which the search ends.
    double max_radius = limit("neighbours.max_radius", 40);
};
COVOL_HEURISTICS NeighboursHeuristics kNear{};

/// Distance to the nearest point: spacing.cpp.
struct SpacingHeuristics {
    /// [points] Maximum number of sampled points. All lengths of a cloud are relative to their median, hence more than
    /// common.sample.
    std::size_t queries = limit("spacing.queries", 50000);
};
COVOL_HEURISTICS SpacingHeuristics kPointSpacing{};

/// Scans whose layer of points is thicker than their spacing: scan_noise.cpp.
struct ScanNoiseHeuristics {
    /// [voxels] Maximum mean distance to the local plane for a voxel size that resolves the layer as one surface.
    double thin_fraction = heuristic("scan_noise.thin_fraction", 0.35);
    /// [voxels] The same if larger voxel sizes exceed it because the surface is curved; scans as thick as their spacing
    /// have 0.3 to 0.45.
    double clean_fraction = heuristic("scan_noise.clean_fraction", 0.25);
    /// [voxels] Radius of the local plane.
    double plane_voxels = heuristic("scan_noise.plane_voxels", 2.5);
    /// [steps] Of common.growth from the spacing to the largest voxel size.
    int coarsest = heuristic("scan_noise.coarsest", 5);
    /// [passes] Of averaging layers.
    int passes = heuristic("scan_noise.passes", 2);
};
COVOL_HEURISTICS ScanNoiseHeuristics kScan{};

/// Marks from misplaced clicks: isolated_points.cpp.
struct IsolatedHeuristics {
    /// [median links] Alternative to `gap`: minimum length of the shortest link to an isolated point, because the gap
    /// may be hidden by several isolated points at different places. For marks on the same seven structures, links are
    /// at most 2.6.
    double far = heuristic("isolated.far", 6.0);
};
COVOL_HEURISTICS IsolatedHeuristics kIsolated{};

}  // namespace covol
