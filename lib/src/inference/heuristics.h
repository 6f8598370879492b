#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristics.h"

namespace covol {

/// The body inferred from marks and image: candidate.cpp and infer.cpp. Cells are the finest edges of a lattice's
/// cells.
struct InferenceHeuristics {
    /// [nodes] Of the lattice on which candidates are compared; that of the result has cells of half the size.
    double coarse_nodes = heuristic("inference.coarse_nodes", 60000);
    /// [voxels] Maximum of a box around the marks: a larger one takes long to read.
    double max_voxels = limit("inference.max_voxels", 6.4e7);
    /// [marks] Maximum number from which a guess is made; such a guess predicts the remaining marks. It is also the
    /// maximum number of positions known to be inside, or outside, that are used. All are chosen as far apart as
    /// possible.
    std::size_t guess_marks = heuristic("inference.guess_marks", 150);
    /// [spacings] Height above the marks' convex hull, from which a body is improbable.
    double above_hull = heuristic("inference.above_hull", 0.5);
    /// [log odds] Maximum for a single position, and decrease in a spacing above that height.
    double max_odds = heuristic("inference.max_odds", 4);
    /// [cells of surface] Weight of a cell with log odds of one nat.
    double odds_weight = heuristic("inference.odds_weight", 0.6);
    /// [cells or voxels] Maximum plausible distance of a right mark from the surface that it marks.
    double off_cells = heuristic("inference.off_cells", 2);
    /// [of the marks] Maximum that a body may leave, or that may be wrong: if more are, the body is wrong instead.
    double max_off = heuristic("inference.max_off", 0.2);
    /// [of the marks] That are expected to be wrong; a part of the body that fewer marks touch is none.
    double wrong = heuristic("inference.wrong", 0.05);
    /// [of the distance by which it misses a mark] Radius around the mark within which a guess is redrawn.
    double redrawn = heuristic("inference.redrawn", 1.8);
    /// [voxels] Maximum distance by which a guess may miss a mark.
    double farthest_miss = heuristic("inference.farthest_miss", 30);
    /// [bits] Minimum information of the image about the sides of a guess, for the image to redraw it.
    double redraw_bits = heuristic("inference.redraw_bits", 0.3);
    /// [1 - Dice] Expected value for a result whose error times its area equals its volume. It was fitted to 118 runs
    /// of 20 structures with 20, 60 and 300 marks; of 66 runs of 11 other structures, which were not used for the fit,
    /// 92 % lie in the interval.
    double expected_scale = heuristic("inference.expected_scale", 0.47);
    /// [power] With which 1 - Dice increases with that error.
    double expected_power = heuristic("inference.expected_power", 1.15);
    /// [ratio] Of the actual to the expected 1 - Dice; it is exceeded in one of twenty runs, and its inverse undercut
    /// in another.
    double expected_factor = heuristic("inference.expected_factor", 2);
};
COVOL_HEURISTICS InferenceHeuristics kInference{};

}  // namespace covol
