#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// Slices of contours: contours.cpp.
struct ContoursHeuristics {
    /// [voxels] Maximum deviation of marks from their common slice; without an image it is kCommon.same_place of their
    /// extent.
    double same_slice = heuristic("contours.same_slice", 0.1);
    /// [count] Approximate maximum of marks along contours in planes of several directions.
    double network_marks = limit("contours.network_marks", 1500);
    /// [count] Maximum number of seeds inside, and of seeds outside, that are taken from each of these planes.
    double network_discs = limit("contours.network_discs", 64);
    /// [of the section's extent] Margin around a section's contours in which seeds outside are placed.
    double network_around = heuristic("contours.network_around", 0.25);
};
COVOL_HEURISTICS ContoursHeuristics kContours{};

}  // namespace covol
