#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristics.h"

namespace covol {

/// The body inferred from marks and image: candidate.cpp and infer.cpp. As a length, a cell is the shortest edge of a
/// lattice's cells.
struct InferenceHeuristics {
    /// [nodes] Maximum of the lattice on which candidates are compared; the cells of the result's are half as large.
    double coarse_nodes = heuristic("inference.coarse_nodes", 60000);
    /// [voxels] Maximum of the image's box around the marks; a larger box takes too long to read.
    double max_voxels = limit("inference.max_voxels", 6.4e7);
    /// [marks] Maximum number of marks from which the guess of a body is computed; also the maximum number of positions
    /// inside, and of positions outside, that are used. If there are more, those that are farthest apart are chosen.
    std::size_t guess_marks = limit("inference.guess_marks", 150);
    /// [spacings] Height above the marks' convex hull from which on a body is improbable.
    double above_hull = heuristic("inference.above_hull", 0.5);
    /// [log odds] Maximum for a single position, and the decrease of the log odds of inside per spacing of height above
    /// above_hull.
    double max_odds = heuristic("inference.max_odds", 4);
    /// [cells of surface] Area of surface of weight 1 that costs as much as a cell that is put inside although its log
    /// odds of outside are 1, or the reverse.
    double odds_weight = heuristic("inference.odds_weight", 0.6);
    /// [cells or voxels] Maximum plausible distance of a correct mark from the surface that it marks: cells on the
    /// lattice of an inferred body, otherwise voxels.
    double off_cells = heuristic("inference.off_cells", 2);
    /// [voxels] Distance up to which misses of a guess are measured: margin of the box around the missed marks in which
    /// the distances from its surface are computed.
    double farthest_miss = limit("inference.farthest_miss", 30);
    /// [bits] Minimum information that the image gives about the two sides of a guess; with less it is not redrawn.
    double redraw_bits = heuristic("inference.redraw_bits", 0.3);
    /// [1 - Dice] Expected value for a result whose mean error at held-out marks times its area equals its volume. It
    /// was fitted to 118 runs of 20 structures with 20, 60 and 300 marks; of 330 runs of 11 other structures, which
    /// were not used for the fit, 92 % lie in the interval that follows from expected_factor.
    double expected_scale = heuristic("inference.expected_scale", 0.47);
    /// [power] Exponent of the ratio error * area / volume in the expected value of 1 - Dice.
    double expected_power = heuristic("inference.expected_power", 1.15);
    /// [ratio] Ratio of the actual to the expected 1 - Dice that one of twenty runs exceeds; in one of twenty it is
    /// smaller than the inverse.
    double expected_factor = heuristic("inference.expected_factor", 2);
};
COVOL_HEURISTICS InferenceHeuristics kInference{};

/// Maximum fraction of the marks that may lie off a body, or may be left out as wrong: clearly more than the exceptions
/// that are expected.
inline double max_fraction_off() { return kCommon.clear_ratio * kCommon.minority; }

}  // namespace covol
