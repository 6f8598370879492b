#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristic.h"

namespace covol {

/// The body inferred from marks and image: candidate.cpp and infer.cpp. Cells are the finest edges of a lattice's
/// cells.
struct InferenceHeuristics {
    /// [nodes] Of the lattice on which candidates are compared.
    double coarse_nodes = heuristic("inference.coarse_nodes", 60000);
    /// [nodes] Maximum of the lattice of the result.
    double fine_nodes = heuristic("inference.fine_nodes", 400000);
    /// [voxels] Maximum of a box around the marks: a larger one takes long to read.
    double max_voxels = heuristic("inference.max_voxels", 6.4e7);
    /// [of the memory limit] Maximum that this box may take in single precision.
    double max_memory_fraction = heuristic("inference.max_memory_fraction", 0.25);
    /// [marks] From which guesses are made; the others are predicted.
    std::size_t guess_marks = heuristic("inference.guess_marks", 150);
    /// [marks] Minimum from which inside and outside can be learnt.
    std::size_t fewest_marks = heuristic("inference.fewest_marks", 12);
    /// [voxels] Margin around the marks' box; the spacing of the marks if that is larger.
    double around_voxels = heuristic("inference.around_voxels", 8);
    /// [spacings] Height above the marks' convex hull, from which a body is improbable.
    double hull_slack = heuristic("inference.hull_slack", 0.3);
    /// [log odds a spacing] Penalty beyond that height.
    double hull_odds = heuristic("inference.hull_odds", 3.5);
    /// [spacings] Height above the hull, beyond which the image is taken as an example of outside.
    double surely_outside = heuristic("inference.surely_outside", 0.5);
    /// [log odds] Maximum for a single position.
    double max_odds = heuristic("inference.max_odds", 4);
    /// [cells of surface] Weight of a cell with log odds of one nat.
    double odds_weight = heuristic("inference.odds_weight", 0.6);
    /// [of a cell of surface] Cost of surface at a mark if the image is uniform.
    double surface_at_marks = heuristic("inference.surface_at_marks", 0.1);
    /// [prior precision] Of the regression's standardised coefficients.
    double ridge = heuristic("inference.ridge", 3);
    /// [iterations] Of the primal-dual algorithm.
    int iterations = heuristic("inference.iterations", 150);
    /// [mean eigenvalues of the energy] Strength of the image's gradients as axes of the normals.
    double axes_strength = heuristic("inference.axes_strength", 1);
    /// [mean eigenvalues of the energy] Strength of normals taken from a body.
    double normals_strength = heuristic("inference.normals_strength", 3);
    /// [median slopes] Slope of the image at which a gradient has full weight as an axis.
    double clear_slope = heuristic("inference.clear_slope", 4);
    /// [cells] Maximum distance of a mark from a surface that passes it.
    double on_mark = heuristic("inference.on_mark", 1.5);
    /// [candidates] Number of the best ones, whose normals are the proposals for the next ones.
    int continued = heuristic("inference.continued", 2);
    /// [rounds] Number of such continuations.
    int rounds = heuristic("inference.rounds", 2);
    /// [of the marks that the body reaches] Minimum for a part; parts with fewer are removed.
    double min_part = heuristic("inference.min_part", 0.05);
    /// [cells] Half-width of the band around the coarse body's surface in which the image is evaluated on the fine
    /// lattice; outside of it the fine body equals the coarse one.
    double fine_band = heuristic("inference.fine_band", 2.5);
    /// [places] Maximum number of positions known to be inside, or outside, that are used: as far apart as possible.
    std::size_t max_places = heuristic("inference.max_places", 200);
    /// [cells] Distance of a mark from the body's surface, beyond which the body has left the mark.
    double off_cells = heuristic("inference.off_cells", 2);
    /// [of the marks] Maximum that a body may leave.
    double max_off = heuristic("inference.max_off", 0.15);
    /// [marks] Minimum for the detection of wrong marks: with fewer, the body itself lacks parts.
    std::size_t wrong_from_marks = heuristic("inference.wrong_from_marks", 40);
    /// [of the marks] Prior fraction of wrong marks.
    double wrong_prior = heuristic("inference.wrong_prior", 0.05);
    /// [cells] Mean distance of right marks from the body.
    double usual_off = heuristic("inference.usual_off", 0.3);
    /// [of the marks] Maximum that may be wrong: if more appear to be, the body is wrong instead.
    double max_wrong = heuristic("inference.max_wrong", 0.2);
    /// [spacings] Radius within which two other suspects indicate that a mark is right and the body lacks a part.
    double beside_spacings = heuristic("inference.beside_spacings", 3);
    /// [rounds] Maximum number of rounds in which wrong marks are left out.
    int wrong_rounds = heuristic("inference.wrong_rounds", 4);
    /// [voxels] Distance of a mark from a guess, beyond which the guess misses it; at least half of the widest spacing.
    double missed_voxels = heuristic("inference.missed_voxels", 1.5);
    /// [of the distance by which it misses a mark] Radius around the mark within which a guess is redrawn.
    double redrawn = heuristic("inference.redrawn", 1.8);
    /// [voxels] Maximum distance by which a guess may miss a mark.
    double farthest_miss = heuristic("inference.farthest_miss", 30);
    /// [bits] Minimum information of the image about the sides of a guess, for the image to redraw it.
    double redraw_bits = heuristic("inference.redraw_bits", 0.3);
    /// [Dice] Of guess and body, above which they count as equal.
    double agreement = heuristic("inference.agreement", 0.9);
    /// [1 - Dice] Of a result whose error times its area is its volume: fitted to 118 runs of 20 structures with 20, 60
    /// and 300 marks; of 66 runs of 11 other structures, not used for the fit, 92 % lie in the interval.
    double expected_scale = heuristic("inference.expected_scale", 0.47);
    /// [power] With which 1 - Dice increases with that error.
    double expected_power = heuristic("inference.expected_power", 1.15);
    /// [ratio] Of the actual to the expected 1 - Dice; it is exceeded in one of twenty runs, and its inverse undercut
    /// in another.
    double expected_factor = heuristic("inference.expected_factor", 2);
};
COVOL_HEURISTICS InferenceHeuristics kInference{};

}  // namespace covol
