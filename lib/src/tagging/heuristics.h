#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include <cstdint>

#include "base/heuristics.h"

namespace covol {

/// The tag distance D: tag_distance.cpp.
struct TagDistanceHeuristics {
    /// [ratio] The same for a core with a large fraction of the cloud's area.
    double significant_ratio = heuristic("tag_distance.significant_ratio", 1.25);
    /// [fraction of the cloud's area] Minimum of all such cores; less are pockets of a cloud without an inside.
    double structure_fraction = heuristic("tag_distance.structure_fraction", 0.25);
    /// [ratio] Of D to the largest gap that it closes, in addition to half a cell, by which the gap is uncertain.
    double margin = heuristic("tag_distance.margin", 1.05);
    /// [voxels] Maximum in the tube on the last grid, to limit time and memory.
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
