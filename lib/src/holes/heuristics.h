#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// Holes of a cloud: holes.cpp.
struct HolesHeuristics {
    /// [spacings, and voxels] Automatic distance from the points beyond which a surface is a hole: the larger one.
    double far = heuristic("holes.far", 3);
    /// [fraction of that distance] Standard deviation of the smoothing of the rim: removes undulations shorter than
    /// about three standard deviations.
    double smoothing = heuristic("holes.smoothing", 0.5);
};
COVOL_HEURISTICS HolesHeuristics kHoles{};

/// The cut along a hole's rim: cut.cpp.
struct CutHeuristics {
    /// [edges] Distance from the line below which a vertex is moved onto it.
    float close = heuristic("cut.close", 0.3F);
};
COVOL_HEURISTICS CutHeuristics kCut{};

}  // namespace covol
