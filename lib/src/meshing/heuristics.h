#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// Triangles without slivers: relax.cpp.
struct RelaxHeuristics {
    /// [moves] Of all vertices in each round.
    int moves_per_round = heuristic("relax.moves_per_round", 5);
    /// [tangential moves] Maximum of the projection onto the level set that follows a move.
    double drop = heuristic("relax.drop", 0.5);
    /// [cosine] Of an angle, 30 degrees, half of that of equilateral triangles: triangles without smaller angles are
    /// skipped after the first round, and the shortest side of those with smaller ones is collapsed.
    double sliver = heuristic("relax.sliver", 0.866);
    /// [voxels] Maximum distance from the level set of a flipped edge, unless it was as far before, and of merged ends.
    double off_level = heuristic("relax.off_level", 0.1);
};
COVOL_HEURISTICS RelaxHeuristics kRelax{};

/// Decimation: decimate.cpp. Garland and Heckbert, Surface simplification using quadric error metrics, SIGGRAPH 1997.
struct DecimateHeuristics {
    /// [ratio] Weight of the fourth power of an edge's length, relative to squared distances from planes times areas.
    double roundness = heuristic("decimate.roundness", 3e-3);
};
COVOL_HEURISTICS DecimateHeuristics kDecimate{};

/// Projection of vertices onto the level set: level.cpp.
struct LevelHeuristics {
    /// [fraction of the slope of a distance] Minimum slope for estimates of the distance, because it vanishes between
    /// two walls.
    double min_slope = heuristic("level.min_slope", 0.5);
};
COVOL_HEURISTICS LevelHeuristics kLevel{};

}  // namespace covol
