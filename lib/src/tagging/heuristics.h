#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include <cstdint>

#include "base/heuristic.h"

namespace covol {

/// The tag distance D: tag_distance.cpp.
struct TagDistanceHeuristics {
    /// [ratio] Peak to saddle of a core that is a structure, not a pocket in a wall.
    double clear_ratio = heuristic("tag_distance.clear_ratio", 2.0);
    /// [ratio] The same for a core that takes a large share of the cloud.
    double significant_ratio = heuristic("tag_distance.significant_ratio", 1.25);
    /// [share of the cloud's area] Which is large.
    double large_fraction = heuristic("tag_distance.large_fraction", 0.1);
    /// [volumes of the most important core] A core that D has to hold.
    double important_fraction = heuristic("tag_distance.important_fraction", 0.1);
    /// [share of the cloud's area] Less is pockets of a cloud without an inside.
    double structure_fraction = heuristic("tag_distance.structure_fraction", 0.25);
    /// [voxels] Of the tube on the first grid.
    std::int64_t coarse_voxels = heuristic("tag_distance.coarse_voxels", 200'000);
    /// [voxels] Of the tube on the last grid: time and memory.
    std::int64_t max_tube_voxels = heuristic("tag_distance.max_tube_voxels", 1'500'000);
    /// [buckets] Of distances, in a voxel.
    double buckets_per_voxel = heuristic("tag_distance.buckets_per_voxel", 16);
};
COVOL_HEURISTICS TagDistanceHeuristics kTagDistance{};

/// Tagged cores that are pockets: tagging.cpp.
struct TaggingHeuristics {
    /// [enclosed volumes] A core that is less, grown by D, is a pocket.
    double significant_fraction = heuristic("tagging.significant_fraction", 0.04);
    /// [D] A core that is thinner is a pocket.
    double significant_radius = heuristic("tagging.significant_radius", 0.25);
};
COVOL_HEURISTICS TaggingHeuristics kTagging{};

/// Closing of a tagged body by a ball of radius D: closing.cpp.
struct ClosingHeuristics {
    /// [voxels] Beyond D, enough for a band around the closing's surface.
    double reach_voxels = heuristic("closing.reach_voxels", 6.0);
};
COVOL_HEURISTICS ClosingHeuristics kClosing{};

}  // namespace covol
