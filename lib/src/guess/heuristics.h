#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristics.h"

namespace covol {

/// The guess from marks: guess.cpp.
struct GuessHeuristics {
    /// [ellipsoids around the marks] Size of the ellipsoid on which constraints close a surface that extends beyond one
    /// of twice that size. The surface through marks on half a ball closes within an ellipsoid of size 2, and gets no
    /// constraints.
    double held_at = heuristic("guess.held_at", 1.5);
};
COVOL_HEURISTICS GuessHeuristics kGuess{};

/// A guess corrected by marks: guess_correction.cpp.
struct CorrectionHeuristics {
    /// [distances between mark and guess] Radius of a bump that moves the guess inward. Above 2.11 the bump is less
    /// steep than the guess's distance, so that the result remains monotone across the surface
    /// (covol/guess_correction.h).
    double radius_of_residual = heuristic("correction.radius_of_residual", 3.0);
    /// [distances between mark and guess] Radius of a bump that moves the guess outward; a wide one inflates the
    /// correct surface beside a missing part (tests/bench/marks/correction.py).
    double radius_outward = heuristic("correction.radius_outward", 2.2);
};
COVOL_HEURISTICS CorrectionHeuristics kCorrection{};

/// The surface through marks, as a whole and in overlapping parts: marks_surface.cpp.
struct MarksSurfaceHeuristics {
    /// [marks] Maximum number for the surface as a whole, because the time grows with the cube of the number.
    std::size_t whole = heuristic("marks_surface.whole", 300);
};
COVOL_HEURISTICS MarksSurfaceHeuristics kMarks{};

}  // namespace covol
