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
    /// [fraction of the cloud's area] Minimum of all main cores together; with less, the cloud encloses only pockets.
    double structure_fraction = heuristic("tag_distance.structure_fraction", 0.25);
    /// [ratio] Of D to the radius of the largest gap that it closes. Half a cell, the gap's uncertainty, is added.
    double margin = heuristic("tag_distance.margin", 1.05);
    /// [voxels] Maximum of the tube on the finest grid, to limit time and memory.
    std::int64_t max_tube_voxels = limit("tag_distance.max_tube_voxels", 1'500'000);
};
COVOL_HEURISTICS TagDistanceHeuristics kTagDistance{};

/// Tagged cores that are pockets: tagging.cpp.
struct TaggingHeuristics {
    /// [D] A core with a smaller radius is a pocket.
    double significant_radius = heuristic("tagging.significant_radius", 0.25);
};
COVOL_HEURISTICS TaggingHeuristics kTagging{};

}  // namespace covol
