#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include "base/heuristic.h"

namespace covol {

/// What painted labels mean: painted.cpp, whole_runs.cpp.
struct PaintedHeuristics {
    /// [voxels] A patch that is nowhere wider says little about a cross-section.
    int narrowest = heuristic("painted.narrowest", 3);
    /// [ratio] Of the widest patch to a run of painted slices, at least, for them to be slices.
    int thin_run = heuristic("painted.thin_run", 3);
    /// [of the largest section] A section that is taken for as large.
    double about_largest = heuristic("painted.about_largest", 0.9);
    /// [squares of its width] A section that is larger is longer than wide: a disc has 1.3 to 1.8.
    double elongated = heuristic("painted.elongated", 2);
    /// [of the widest ends] Ends that are taken for as wide.
    double as_wide = heuristic("painted.as_wide", 0.98);
};
COVOL_HEURISTICS PaintedHeuristics kPainted{};

/// Outlines of patches: outline.cpp. Measured over digitised discs of radius 1.5 to 40 at 20 places each: the mean
/// error is below 0.025 voxel (0.44 with a Gaussian of 1 voxel at radius 1.5), the root mean square 0.10 to 0.13 from
/// radius 5 on, where the staircase has 0.235.
struct OutlineHeuristics {
    /// [voxels] To either side along the line, of the quadratic that smooths it.
    int window = heuristic("outline.window", 8);
    /// [of the line's length] The same, at most.
    double window_of_line = heuristic("outline.window_of_line", 0.15);
    /// [voxels] That smoothing may move a place.
    double max_shift = heuristic("outline.max_shift", 0.5);
    /// [voxels] Of a scribble.
    int widest_stroke = heuristic("outline.widest_stroke", 4);
    /// [widths] Of a scribble, at least.
    double stroke_length = heuristic("outline.stroke_length", 6);
};
COVOL_HEURISTICS OutlineHeuristics kOutline{};

}  // namespace covol
