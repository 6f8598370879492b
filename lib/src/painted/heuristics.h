#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// Outlines of patches: outline.cpp. Distances of the outlines' vertices from the circle were measured on digitised
/// discs of radius 1.5 to 40 at 20 positions each: the mean is below 0.025 voxel (0.44 with a Gaussian of 1 voxel at
/// radius 1.5), the root mean square 0.10 to 0.13 from radius 5 on, compared to 0.235 for the staircase.
struct OutlineHeuristics {
    /// [voxels] Half-width, along the outline, of the window in which a quadratic smooths it.
    int window = heuristic("outline.window", 8);
    /// [of the line's length] Maximum half-width of the window in which an outline is smoothed, for short outlines.
    double window_of_line = heuristic("outline.window_of_line", 0.15);
    /// [voxels] Maximum width of a patch that counts as a scribble, not as an area.
    int widest_stroke = heuristic("outline.widest_stroke", 4);
    /// [widths] Minimum length of a patch that counts as a scribble.
    double stroke_length = heuristic("outline.stroke_length", 6);
};
COVOL_HEURISTICS OutlineHeuristics kOutline{};

}  // namespace covol
