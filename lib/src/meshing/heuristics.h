#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristic.h"

namespace covol {

/// Triangles without slivers: relax.cpp.
struct RelaxHeuristics {
    /// [moves] Of all vertices in each round.
    int moves_per_round = heuristic("relax.moves_per_round", 5);
    /// [fraction of the way to the neighbours' mean] Length of a move.
    double step = heuristic("relax.step", 0.7);
    /// [cosine] Minimum between a triangle's normals before and after a move.
    double same_side = heuristic("relax.same_side", 0.3);
    /// [cosine] Minimum between the normals of triangles before and after an edge is flipped.
    double smooth = heuristic("relax.smooth", 0.5);
    /// [tangential moves] Maximum of the projection onto the level set that follows a move.
    double drop = heuristic("relax.drop", 0.5);
    /// [cosine] Minimum improvement for which an edge is flipped.
    double gain = heuristic("relax.gain", 1e-3);
    /// [cosine] Of an angle, 32 degrees: triangles without smaller angles are skipped after the first round.
    double poor = heuristic("relax.poor", 0.85);
    /// [cosine] Of an angle, 26 degrees, below which a triangle's shortest side is collapsed.
    double sliver = heuristic("relax.sliver", 0.9);
    /// [voxels] Maximum length of a side that is collapsed.
    double short_side = heuristic("relax.short_side", 0.5);
    /// [voxels] Maximum distance from the level set of a flipped edge, unless it was as far before, and of merged ends.
    double off_level = heuristic("relax.off_level", 0.1);
};
COVOL_HEURISTICS RelaxHeuristics kRelax{};

/// Decimation: decimate.cpp. Garland and Heckbert, Surface simplification using quadric error metrics, SIGGRAPH 1997.
struct DecimateHeuristics {
    /// [ratio] Weight of the fourth power of an edge's length, relative to squared distances from planes times areas.
    double roundness = heuristic("decimate.roundness", 3e-3);
    /// [cosine] Minimum between a triangle's normals before and after a collapse.
    double turn = heuristic("decimate.turn", 0.5);
    /// [cosine] Of an angle, 19 degrees: with a tolerance the goal is well-shaped triangles, not few, and none may have
    /// a smaller angle.
    double adaptive_needle = heuristic("decimate.adaptive_needle", 0.945);
    /// [passes] A collapse that another one prevented is tried again in the next.
    int passes = heuristic("decimate.passes", 3);
};
COVOL_HEURISTICS DecimateHeuristics kDecimate{};

/// Projection of vertices onto the level set: level.cpp.
struct LevelHeuristics {
    /// [steps] Of Newton's method.
    int steps = heuristic("level.steps", 6);
    /// [voxels] Maximum length of a step.
    double longest = heuristic("level.longest", 0.5);
    /// [voxels] Maximum length of all steps together.
    double reach = heuristic("level.reach", 1.0);
    /// [fraction of the slope of a distance] Slope below which there is no direction to move.
    double flat = heuristic("level.flat", 0.05);
    /// [fraction of the slope of a distance] Minimum slope for estimates of the distance, because it vanishes between
    /// two walls.
    double min_slope = heuristic("level.min_slope", 0.5);
    /// [voxels] Maximum distance between the sampled positions of a triangle.
    double sampling = heuristic("level.sampling", 0.75);
};
COVOL_HEURISTICS LevelHeuristics kLevel{};

}  // namespace covol
