#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// Triangles without slivers: relax.cpp.
struct RelaxHeuristics {
    /// [moves] Number of moves of each chosen vertex in a round.
    int moves_per_round = heuristic("relax.moves_per_round", 5);
    /// [tangential moves] Maximum distance from a vertex after its tangential move to its projection onto the level
    /// set, as a multiple of the length of that move; a vertex that exceeds it is not moved.
    double drop = heuristic("relax.drop", 0.5);
    /// [cosine] Of 30 degrees, half of the angle of equilateral triangles. Triangles with a smaller angle are slivers:
    /// their shortest side is collapsed, and rounds after the first process only them and their surroundings.
    double sliver = heuristic("relax.sliver", 0.866);
    /// [voxels] Maximum distance from the level set of the middle of an edge that is collapsed, or results from a flip
    /// (unless the middle was as far away before).
    double off_level = heuristic("relax.off_level", 0.1);
};
COVOL_HEURISTICS RelaxHeuristics kRelax{};

/// Decimation: decimate.cpp. Garland and Heckbert, Surface simplification using quadric error metrics, SIGGRAPH 1997.
struct DecimateHeuristics {
    /// [ratio] Weight of the fourth power of an edge's length in the cost of its collapse, relative to the quadric
    /// error (squared distances from planes times areas).
    double roundness = heuristic("decimate.roundness", 3e-3);
};
COVOL_HEURISTICS DecimateHeuristics kDecimate{};

}  // namespace covol
