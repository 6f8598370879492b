#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include "base/heuristic.h"

namespace covol {

/// Triangles without slivers: relax.cpp.
struct RelaxHeuristics {
    /// [moves] Of all vertices in a round.
    int moves_per_round = heuristic("relax.moves_per_round", 5);
    /// [of the way to the middle of the neighbours] Of a move.
    double step = heuristic("relax.step", 0.7);
    /// [cosine] A triangle may not turn farther in a move.
    double same_side = heuristic("relax.same_side", 0.3);
    /// [cosine] Farther than this neighbours are not turned into each other.
    double smooth = heuristic("relax.smooth", 0.5);
    /// [tangential moves] What the projection may add to one.
    double drop = heuristic("relax.drop", 0.5);
    /// [cosine] Below this an edge is not worth turning.
    double gain = heuristic("relax.gain", 1e-3);
    /// [cosine] Of an angle, 32 degrees: what is better needs no second round.
    double poor = heuristic("relax.poor", 0.85);
    /// [cosine] Of an angle, 26 degrees: below it a triangle's shortest side is drawn together.
    double sliver = heuristic("relax.sliver", 0.9);
    /// [voxels] Longer sides are not.
    double short_side = heuristic("relax.short_side", 0.5);
    /// [voxels] A turned edge may leave the level set so far, or as far as before; ends that meet so far.
    double off_level = heuristic("relax.off_level", 0.1);
};
COVOL_HEURISTICS RelaxHeuristics kRelax{};

/// Decimation: decimate.cpp. Garland and Heckbert, Surface simplification using quadric error metrics, SIGGRAPH 1997.
struct DecimateHeuristics {
    /// [ratio] Weight of an edge's length, to the fourth power, against squared distances from planes times areas.
    double roundness = heuristic("decimate.roundness", 3e-3);
    /// [cosine] A triangle may not turn farther.
    double turn = heuristic("decimate.turn", 0.5);
    /// [cosine] 19 degrees: with a tolerance the goal is good triangles, not few, and none may have less.
    double adaptive_needle = heuristic("decimate.adaptive_needle", 0.945);
    /// [passes] A collapse that was in another's way is asked for again in the next.
    int passes = heuristic("decimate.passes", 3);
};
COVOL_HEURISTICS DecimateHeuristics kDecimate{};

/// Vertices put onto the level set: level.cpp.
struct LevelHeuristics {
    /// [steps] Of Newton's method.
    int steps = heuristic("level.steps", 6);
    /// [voxels] Of a step.
    double longest = heuristic("level.longest", 0.5);
    /// [voxels] Of all steps.
    double reach = heuristic("level.reach", 1.0);
    /// [of the slope of a distance] No direction to go.
    double flat = heuristic("level.flat", 0.05);
    /// [of the slope of a distance] Between two walls it has none.
    double min_slope = heuristic("level.min_slope", 0.5);
    /// [voxels] Between places of a triangle that are looked at.
    double sampling = heuristic("level.sampling", 0.75);
};
COVOL_HEURISTICS LevelHeuristics kLevel{};

}  // namespace covol
