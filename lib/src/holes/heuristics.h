#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristic.h"

namespace covol {

/// Holes of a cloud: holes.cpp.
struct HolesHeuristics {
    /// [spacings, and voxels] Automatic distance to the points from which on a surface is a hole.
    double far = heuristic("holes.far", 3);
    /// [fraction of that distance] Smoothing width of the rim: removes undulations shorter than about three times that.
    double smoothing = heuristic("holes.smoothing", 0.5);
    /// [fraction of the way to the neighbours' mean] Step of smoothing.
    float step = heuristic("holes.step", 0.5F);
};
COVOL_HEURISTICS HolesHeuristics kHoles{};

/// The cut along a hole's rim: cut.cpp.
struct CutHeuristics {
    /// [edges] Distance from the line below which a vertex is moved onto it.
    float close = heuristic("cut.close", 0.3F);
    /// [cosine] Minimum between the normals of a triangle before and after the move.
    double min_cosine = heuristic("cut.min_cosine", 0.5);
    /// [rounds] Maximum number of rounds of undoing moves that turn a triangle.
    int undo_rounds = heuristic("cut.undo_rounds", 4);
};
COVOL_HEURISTICS CutHeuristics kCut{};

/// The surface of minimum area: membrane.cpp. Pinkall and Polthier, Computing discrete minimal surfaces, Exp. Math.
/// 2(1), 1993.
struct MembraneHeuristics {
    /// [rounds] Maximum number of solutions with updated cotangents.
    int max_rounds = heuristic("membrane.max_rounds", 20);
    /// [mean edges] Largest move in a round below which the iteration ends.
    double steady = heuristic("membrane.steady", 1e-3);
    /// [cotangent] Minimum weight, because triangles without area have no cotangent.
    double min_weight = heuristic("membrane.min_weight", 1e-3);
    /// [cotangent] Maximum weight, for the same reason.
    double max_weight = heuristic("membrane.max_weight", 100);
};
COVOL_HEURISTICS MembraneHeuristics kMembrane{};

}  // namespace covol
