#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// Holes of a cloud: holes.cpp.
struct HolesHeuristics {
    /// [spacings, and voxels] Automatic distance from the points beyond which a surface is a hole: this number of
    /// spacings of the points or this number of voxels, whichever is longer.
    double far = heuristic("holes.far", 3);
    /// [fraction of that distance] Standard deviation of the smoothing of a hole's rim, relative to the distance beyond
    /// which a surface is a hole. It removes undulations shorter than about three standard deviations.
    double smoothing = heuristic("holes.smoothing", 0.5);
};
COVOL_HEURISTICS HolesHeuristics kHoles{};

/// The cut along a hole's rim: cut.cpp.
struct CutHeuristics {
    /// [edges] Distance of a vertex from the line of the cut, measured along an edge of the mesh, below which the
    /// vertex is moved onto the line.
    float close = heuristic("cut.close", 0.3F);
};
COVOL_HEURISTICS CutHeuristics kCut{};

}  // namespace covol
