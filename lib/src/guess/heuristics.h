#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristics.h"

namespace covol {

/// The guess from marks: guess.cpp.
struct GuessHeuristics {
    /// [ellipsoids around the marks] Position of the constraints that close a surface which extends beyond twice that;
    /// the surface through marks on half a ball closes within 2.
    double held_at = heuristic("guess.held_at", 1.5);
    /// [pi] Minimum angle of a gap between the directions to the nearest marks in a cut: beside a straight line of
    /// marks it is pi.
    double way_out = heuristic("guess.way_out", 5.0 / 6);
    /// [of the marks in a cut] Maximum without a gap, for marks along an outline: of twelve or more marks all over the
    /// cut at least a sixth have none.
    double surrounded_fraction = heuristic("guess.surrounded_fraction", 0.125);
};
COVOL_HEURISTICS GuessHeuristics kGuess{};

/// A guess corrected by marks: guess_correction.cpp.
struct CorrectionHeuristics {
    /// [distances between mark and guess] Radius of a bump that moves the guess inward: above 2.11 the result is still
    /// a level set (its slope does not change sign), see the public header.
    double radius_of_residual = heuristic("correction.radius_of_residual", 3.0);
    /// [distances between mark and guess] The same outward, where a wide bump inflates the correct surface beside a
    /// missing part (tests/bench/marks/correction.py).
    double radius_outward = heuristic("correction.radius_outward", 2.2);
};
COVOL_HEURISTICS CorrectionHeuristics kCorrection{};

/// The surface through marks, whole and in parts: marks_surface.cpp.
struct MarksSurfaceHeuristics {
    /// [marks] Maximum in the whole, limited by time, which grows with the cube of the number.
    std::size_t whole = heuristic("marks_surface.whole", 300);
};
COVOL_HEURISTICS MarksSurfaceHeuristics kMarks{};

}  // namespace covol
