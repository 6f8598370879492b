#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristic.h"

namespace covol {

/// Slices of contours: contours.cpp.
struct ContoursHeuristics {
    /// [voxels] Maximum deviation of marks from their common slice.
    double same_slice = heuristic("contours.same_slice", 0.1);
    /// [of the line's extent] The same without an image.
    double same_slice_of_extent = heuristic("contours.same_slice_of_extent", 1e-4);
    /// [cells] Margin around the contours within a slice.
    double margin_cells = heuristic("contours.margin_cells", 2);
    /// [cells] By which a section that a side of the image cuts is continued beyond it: its end lies where nothing is
    /// computed.
    double side_cells = heuristic("contours.side_cells", 10);
    /// [cells] By which a body is continued beyond the image's end: more than a band's half width.
    double open_cells = heuristic("contours.open_cells", 6);
    /// [cells] Distance of its flat end from the image's end: a band's half width more than the domain extends.
    double end_cells = heuristic("contours.end_cells", 10);
    /// [count] Approximate maximum of marks along contours in planes of several directions.
    double network_marks = heuristic("contours.network_marks", 1500);
    /// [count] Maximum number of positions on each side that are taken from one of these planes.
    double network_discs = heuristic("contours.network_discs", 64);
    /// [of the section's extent] Margin around its contours, in which positions outside are taken.
    double network_around = heuristic("contours.network_around", 0.25);
    /// [of a contour's step] Distance from a contour at which its outside is determined.
    double network_beside = heuristic("contours.network_beside", 1e-3);
};
COVOL_HEURISTICS ContoursHeuristics kContours{};

}  // namespace covol
