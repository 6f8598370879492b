#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include <cstddef>

#include "base/heuristic.h"

namespace covol {

/// Search for the nearest points of each point: neighbours.h.
struct NeighboursHeuristics {
    /// [spacings] In which they are looked for first; time, not the result.
    double first_radius = heuristic("neighbours.first_radius", 2);
    /// [spacings] Beyond which they are given up.
    double max_radius = heuristic("neighbours.max_radius", 40);
};
COVOL_HEURISTICS NeighboursHeuristics kNear{};

/// Scans whose layer of points is thicker than their spacing: scan_noise.cpp.
struct ScanNoiseHeuristics {
    /// [voxels] Mean distance to the local plane at which a voxel size holds a layer.
    double thin_fraction = heuristic("scan_noise.thin_fraction", 0.35);
    /// [voxels] The same where larger ones bend; scans as thick as their spacing is wide have 0.3 to 0.45.
    double clean_fraction = heuristic("scan_noise.clean_fraction", 0.25);
    /// [voxels] Radius of the local plane.
    double plane_voxels = heuristic("scan_noise.plane_voxels", 2.5);
    /// [ratio] Of a voxel size that is tried to the one below.
    double growth = heuristic("scan_noise.growth", 1.25);
    /// [steps] Of them above the spacing.
    int coarsest = heuristic("scan_noise.coarsest", 7);
    /// [points] Whose planes are looked at.
    std::size_t samples = heuristic("scan_noise.samples", 3000);
    /// [points] That make a plane, and one more.
    std::size_t min_neighbours = heuristic("scan_noise.min_neighbours", 6);
    /// [passes] Of averaging layers.
    int passes = heuristic("scan_noise.passes", 2);
};
COVOL_HEURISTICS ScanNoiseHeuristics kScan{};

/// Distance to the nearest point: spacing.cpp.
struct SpacingHeuristics {
    /// [points] Of which it is taken.
    std::size_t queries = heuristic("spacing.queries", 50000);
};
COVOL_HEURISTICS SpacingHeuristics kPointSpacing{};

/// Marks that a click went astray for: isolated_points.cpp.
struct IsolatedHeuristics {
    /// [points] Fewer tell nothing of what is usual.
    std::size_t min_points = heuristic("isolated.min_points", 10);
    /// [points] More are no marks, but a cloud.
    std::size_t max_points = heuristic("isolated.max_points", 4000);
    /// [longest links] Marks that lie closer to each other are one that was read or clicked twice.
    double same_place = heuristic("isolated.same_place", 1e-3);
    /// [points] That are linked more closely, and apart from the others, at most: four already enclose something.
    std::size_t max_group = heuristic("isolated.max_group", 3);
    /// [share of the points] That lie apart, at most.
    double max_fraction = heuristic("isolated.max_fraction", 0.1);
    /// [ratio] Of the shortest link to one of them to the longest between the others: of marks on seven structures,
    /// evenly and on outlines, successive links differ by 1.4 at most.
    double gap = heuristic("isolated.gap", 2.0);
    /// [median links] The same where many lie apart, each elsewhere: of marks on these structures links have 2.6 at
    /// most.
    double far = heuristic("isolated.far", 6.0);
};
COVOL_HEURISTICS IsolatedHeuristics kIsolated{};

/// Cleaning on demand: cloud_cleanup.cpp.
struct CleanupHeuristics {
    /// [passes] Of removing outliers; each lowers the mean distance that they have raised.
    int max_passes = heuristic("cleanup.max_passes", 10);
    /// [distances to 6 neighbours] Radius of WLOP: two rings of new neighbours; CGAL's own 8 spacings flatten what is
    /// curved.
    double rings = heuristic("cleanup.rings", 2.5);
    /// [points] Neighbours in a ring.
    unsigned ring = heuristic("cleanup.ring", 6U);
};
COVOL_HEURISTICS CleanupHeuristics kCleanup{};

}  // namespace covol
