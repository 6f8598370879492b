#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include <cstddef>

#include "base/heuristic.h"

namespace covol {

/// Growing to the image's edges: grow.cpp. Malladi, Sethian and Vemuri, Shape modeling with front propagation, IEEE
/// Trans. Pattern Anal. Mach. Intell. 17(2), 1995, has the front; where it stops is ours.
struct GrowHeuristics {
    /// [voxels] Around the start that are looked at first.
    double min_pad = heuristic("grow.min_pad", 12);
    /// [of the image's range] Differences below it say nothing.
    double min_spread = heuristic("grow.min_spread", 0.01);
    /// [spreads of the start's surface] A voxel inside that differs more is not like it.
    double unlike = heuristic("grow.unlike", 4);
    /// [share of the inside] More of them, and the start holds something already.
    double unlike_fraction = heuristic("grow.unlike_fraction", 0.03);
    /// [spreads] A difference at which the front's speed is a half.
    double speed_spreads = heuristic("grow.speed_spreads", 2);
    /// [of the speed where nothing differs] The front's, at least.
    double min_speed = heuristic("grow.min_speed", 1e-4);
    /// [of the best front's edge] A start with as much lies at an edge.
    double at_hand = heuristic("grow.at_hand", 0.5);
    /// [spreads] A mean change across the front that noise does not make.
    double clear = heuristic("grow.clear", 0.3);
    /// [standard errors] Of a front's mean change, the same.
    double errors = heuristic("grow.errors", 4);
    /// [of the best front's edge] Less, and the front has left the edge.
    double passed = heuristic("grow.passed", 0.5);
    /// [ratio] Of its volume, by which it has, too.
    double passed_growth = heuristic("grow.passed_growth", 2);
    /// [volumes of the region] What the front has gone around and left out.
    double small_cavity = heuristic("grow.small_cavity", 0.01);
};
COVOL_HEURISTICS GrowHeuristics kGrow{};

/// A start from seeds: start_from_seeds.cpp.
struct SeedsHeuristics {
    /// [seeds] Whose links are searched one by one: time.
    std::size_t max_joined = heuristic("seeds.max_joined", 2000);
};
COVOL_HEURISTICS SeedsHeuristics kSeeds{};

}  // namespace covol
