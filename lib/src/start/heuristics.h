#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristic.h"

namespace covol {

/// Growing to the image's edges: grow.cpp. The front is that of Malladi, Sethian and Vemuri, Shape modeling with front
/// propagation, IEEE Trans. Pattern Anal. Mach. Intell. 17(2), 1995; the stopping criterion is not from there.
struct GrowHeuristics {
    /// [voxels] Minimum margin around the start that is searched first.
    double min_pad = heuristic("grow.min_pad", 12);
    /// [of the image's range] Differences below it are ignored.
    double min_spread = heuristic("grow.min_spread", 0.01);
    /// [spreads of the start's surface] A voxel inside that differs more is not similar to it.
    double unlike = heuristic("grow.unlike", 4);
    /// [fraction of the inside] With more such voxels the start contains an object already.
    double unlike_fraction = heuristic("grow.unlike_fraction", 0.03);
    /// [spreads] Difference at which the front's speed is halved.
    double speed_spreads = heuristic("grow.speed_spreads", 2);
    /// [of the speed without differences] Minimum speed of the front.
    double min_speed = heuristic("grow.min_speed", 1e-4);
    /// [of the best front's edge] A start whose edge is at least as strong lies at an edge already.
    double at_hand = heuristic("grow.at_hand", 0.5);
    /// [spreads] Minimum mean change across the front that is not caused by noise.
    double clear = heuristic("grow.clear", 0.3);
    /// [standard errors] Subtracted from a front's mean change, for noise.
    double errors = heuristic("grow.errors", 4);
    /// [of the best front's edge] Once the front's edge is weaker, the front has left the best edge.
    double passed = heuristic("grow.passed", 0.5);
    /// [ratio] Of the front's volume to that of the best front, required in addition.
    double passed_growth = heuristic("grow.passed_growth", 2);
    /// [volumes of the region] Maximum of a cavity that the front has left out and that is filled.
    double small_cavity = heuristic("grow.small_cavity", 0.01);
};
COVOL_HEURISTICS GrowHeuristics kGrow{};

/// A start from seeds: start_from_seeds.cpp.
struct SeedsHeuristics {
    /// [seeds] Maximum whose connections are searched exactly, to limit the time.
    std::size_t max_joined = heuristic("seeds.max_joined", 2000);
};
COVOL_HEURISTICS SeedsHeuristics kSeeds{};

}  // namespace covol
