#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// The criterion for rebuilding a band around a moved surface: motion.cpp.
struct MotionHeuristics {
    /// [voxels] Mean motion in a leaf at which the surface has left the band's middle.
    double left_by = heuristic("motion.left_by", 0.75);
};
COVOL_HEURISTICS MotionHeuristics kMotion{};

}  // namespace covol
