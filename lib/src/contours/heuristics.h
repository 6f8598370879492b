#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include "base/heuristic.h"

namespace covol {

/// Slices of contours: contours.cpp.
struct ContoursHeuristics {
    /// [voxels] Marks of one slice may differ by this.
    double same_slice = heuristic("contours.same_slice", 0.1);
    /// [of the line's extent] The same without an image.
    double same_slice_of_extent = heuristic("contours.same_slice_of_extent", 1e-4);
    /// [cells] Around the contours within a slice.
    double margin_cells = heuristic("contours.margin_cells", 2);
    /// [cells] The same across the slices: the end of it lies where nothing is computed.
    double side_cells = heuristic("contours.side_cells", 10);
    /// [cells] That a body goes on beyond the image's end: more than a band's half width.
    double open_cells = heuristic("contours.open_cells", 6);
    /// [cells] That its flat end lies beyond the image's: a band's half width more than the domain goes on.
    double end_cells = heuristic("contours.end_cells", 10);
    /// [count] Marks along contours in planes of several directions.
    double network_marks = heuristic("contours.network_marks", 1500);
    /// [count] Places of each side that a plane of them tells, at most.
    double network_discs = heuristic("contours.network_discs", 64);
    /// [of the section's extent] Around its contours, where its outside is told.
    double network_around = heuristic("contours.network_around", 0.25);
    /// [of a contour's step] Beside a contour, where its outside is looked for.
    double network_beside = heuristic("contours.network_beside", 1e-3);
};
COVOL_HEURISTICS ContoursHeuristics kContours{};

}  // namespace covol
