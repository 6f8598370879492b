#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

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
