#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include <cstdint>

#include "base/heuristics.h"

namespace covol {

/// The tag distance D: tag_distance.cpp.
struct TagDistanceHeuristics {
    /// [ratio] Minimum of a core's peak to its saddle if its area is large compared to the cloud's; otherwise
    /// kCommon.clear_ratio is the minimum.
    double significant_ratio = heuristic("tag_distance.significant_ratio", 1.25);
    /// [voxels] Maximum of the tube on the finest grid, to limit time and memory.
    std::int64_t max_tube_voxels = limit("tag_distance.max_tube_voxels", 1'500'000);
};
COVOL_HEURISTICS TagDistanceHeuristics kTagDistance{};

}  // namespace covol
