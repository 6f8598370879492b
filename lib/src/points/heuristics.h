#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristics.h"

namespace covol {

/// Search for the nearest neighbours of each point: neighbours.h.
struct NeighboursHeuristics {
    /// [spacings] Initial search radius; affects the time, not the result.
    double first_radius = heuristic("neighbours.first_radius", 2);
    /// [spacings] Search radius at which the search ends.
    double max_radius = heuristic("neighbours.max_radius", 40);
};
COVOL_HEURISTICS NeighboursHeuristics kNear{};

/// Scans whose layer of points is thicker than their spacing: scan_noise.cpp.
struct ScanNoiseHeuristics {
    /// [voxels] Maximum mean distance to the local plane for a voxel size that resolves the layer as one surface.
    double thin_fraction = heuristic("scan_noise.thin_fraction", 0.35);
    /// [voxels] The same if larger voxel sizes exceed it because the surface is curved; scans as thick as their spacing
    /// have 0.3 to 0.45.
    double clean_fraction = heuristic("scan_noise.clean_fraction", 0.25);
    /// [voxels] Radius of the local plane.
    double plane_voxels = heuristic("scan_noise.plane_voxels", 2.5);
    /// [ratio] Of a voxel size to the next smaller one that is tried.
    double growth = heuristic("scan_noise.growth", 1.25);
    /// [steps] Maximum number above the spacing.
    int coarsest = heuristic("scan_noise.coarsest", 7);
    /// [points] Number of sampled points whose planes are evaluated.
    std::size_t samples = heuristic("scan_noise.samples", 3000);
    /// [points] Minimum number besides the point itself to which a plane is fitted.
    std::size_t min_neighbours = heuristic("scan_noise.min_neighbours", 6);
    /// [passes] Of averaging layers.
    int passes = heuristic("scan_noise.passes", 2);
};
COVOL_HEURISTICS ScanNoiseHeuristics kScan{};

/// Distance to the nearest point: spacing.cpp.
struct SpacingHeuristics {
    /// [points] Maximum number of sampled points.
    std::size_t queries = heuristic("spacing.queries", 50000);
};
COVOL_HEURISTICS SpacingHeuristics kPointSpacing{};

/// Marks from misplaced clicks: isolated_points.cpp.
struct IsolatedHeuristics {
    /// [points] Minimum number for which typical links can be estimated.
    std::size_t min_points = heuristic("isolated.min_points", 10);
    /// [points] Maximum number; more are a cloud instead of marks.
    std::size_t max_points = heuristic("isolated.max_points", 4000);
    /// [longest links] Distance below which marks are the same one, read or clicked twice.
    double same_place = heuristic("isolated.same_place", 1e-3);
    /// [points] Maximum in a group apart from the others: four already enclose a volume.
    std::size_t max_group = heuristic("isolated.max_group", 3);
    /// [fraction of the points] Maximum that may be apart from the others.
    double max_fraction = heuristic("isolated.max_fraction", 0.1);
    /// [ratio] Minimum of the shortest link to one of them to the longest link among the others: for marks on seven
    /// structures, evenly distributed and on outlines, successive links differ by a factor of at most 1.4.
    double gap = heuristic("isolated.gap", 2.0);
    /// [median links] Alternative to `gap`: minimum length of the shortest link to an isolated point, because the gap
    /// may be hidden by several isolated points at different places. For marks on the same seven structures, links are
    /// at most 2.6.
    double far = heuristic("isolated.far", 6.0);
};
COVOL_HEURISTICS IsolatedHeuristics kIsolated{};

/// Cleaning on demand: cloud_cleanup.cpp.
struct CleanupHeuristics {
    /// [passes] Maximum number for removing outliers; each pass reduces the mean distance, which outliers increase.
    int max_passes = heuristic("cleanup.max_passes", 10);
    /// [distances to 6 neighbours] Radius of WLOP: two rings of new neighbours; CGAL's default of 8 spacings flattens
    /// curved surfaces.
    double rings = heuristic("cleanup.rings", 2.5);
    /// [points] Neighbours in a ring.
    unsigned ring = heuristic("cleanup.ring", 6U);
};
COVOL_HEURISTICS CleanupHeuristics kCleanup{};

}  // namespace covol
