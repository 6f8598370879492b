#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include "base/heuristic.h"

namespace covol {

/// Holes of a cloud: holes.cpp.
struct HolesHeuristics {
    /// [spacings, and voxels] Automatic distance to the points of a hole.
    double far = heuristic("holes.far", 3);
    /// [of that distance] Wiggles of the rim shorter than about three times that go.
    double smoothing = heuristic("holes.smoothing", 0.5);
    /// [of the way to the neighbours' mean] A step of smoothing.
    float step = heuristic("holes.step", 0.5F);
};
COVOL_HEURISTICS HolesHeuristics kHoles{};

/// The cut along a hole's rim: cut.cpp.
struct CutHeuristics {
    /// [edges] A vertex that close to the line is moved onto it.
    float close = heuristic("cut.close", 0.3F);
    /// [cosine] Between a triangle before and after.
    double min_cosine = heuristic("cut.min_cosine", 0.5);
    /// [rounds] Of taking back moves that turn a triangle.
    int undo_rounds = heuristic("cut.undo_rounds", 4);
};
COVOL_HEURISTICS CutHeuristics kCut{};

/// The surface of least area: membrane.cpp. Pinkall and Polthier, Computing discrete minimal surfaces, Exp. Math. 2(1),
/// 1993.
struct MembraneHeuristics {
    /// [rounds] Of solving with new cotangents.
    int max_rounds = heuristic("membrane.max_rounds", 20);
    /// [mean edges] Largest move of a round that is the last.
    double steady = heuristic("membrane.steady", 1e-3);
    /// [cotangent] Triangles without area have none.
    double min_weight = heuristic("membrane.min_weight", 1e-3);
    /// [cotangent] The same.
    double max_weight = heuristic("membrane.max_weight", 100);
};
COVOL_HEURISTICS MembraneHeuristics kMembrane{};

}  // namespace covol
