#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include <cstddef>

#include "base/heuristic.h"

namespace covol {

/// The body that marks and image show: candidate.cpp and infer.cpp. Cells are the finest edges of a lattice's cells.
struct InferenceHeuristics {
    /// [nodes] Of the lattice on which candidates are compared.
    double coarse_nodes = heuristic("inference.coarse_nodes", 60000);
    /// [nodes] Of the lattice of the result, at most.
    double fine_nodes = heuristic("inference.fine_nodes", 400000);
    /// [voxels] Of a box around the marks: a larger one takes long to read.
    double max_voxels = heuristic("inference.max_voxels", 6.4e7);
    /// [of the memory limit] That this box may take as single precision.
    double max_memory_fraction = heuristic("inference.max_memory_fraction", 0.25);
    /// [marks] That guesses are made of; the others are predicted.
    std::size_t guess_marks = heuristic("inference.guess_marks", 150);
    /// [marks] Fewer teach nothing.
    std::size_t fewest_marks = heuristic("inference.fewest_marks", 12);
    /// [voxels] Around the marks' box, and at least their spacing.
    double around_voxels = heuristic("inference.around_voxels", 8);
    /// [spacings] Above the marks' convex hull, from which surface is improbable.
    double hull_slack = heuristic("inference.hull_slack", 0.3);
    /// [log odds a spacing] Beyond that.
    double hull_odds = heuristic("inference.hull_odds", 3.5);
    /// [spacings] Above the hull, beyond which the image shows what is outside.
    double surely_outside = heuristic("inference.surely_outside", 0.5);
    /// [log odds] That one place may say.
    double max_odds = heuristic("inference.max_odds", 4);
    /// [cells of surface] That a cell of one nat is worth.
    double odds_weight = heuristic("inference.odds_weight", 0.6);
    /// [of a cell of surface] What it costs at a mark, where the image is even.
    double surface_at_marks = heuristic("inference.surface_at_marks", 0.1);
    /// [prior precision] Of the regression's standardised terms.
    double ridge = heuristic("inference.ridge", 3);
    /// [iterations] Of the primal-dual algorithm.
    int iterations = heuristic("inference.iterations", 150);
    /// [mean eigenvalues of the energy] Of the image's gradients as axes of the normals.
    double axes_strength = heuristic("inference.axes_strength", 1);
    /// [mean eigenvalues of the energy] Of normals that a body gave.
    double normals_strength = heuristic("inference.normals_strength", 3);
    /// [median slopes] Of the image, at which a gradient counts fully as an axis.
    double clear_slope = heuristic("inference.clear_slope", 4);
    /// [cells] From a mark to a surface that passes it.
    double on_mark = heuristic("inference.on_mark", 1.5);
    /// [candidates] The best ones, whose normals give the next ones.
    int continued = heuristic("inference.continued", 2);
    /// [rounds] In which they do.
    int rounds = heuristic("inference.rounds", 2);
    /// [of the marks that the body reaches] A part with fewer is none of it.
    double min_part = heuristic("inference.min_part", 0.05);
    /// [cells] From the coarse body's surface, beyond which the fine lattice follows it.
    double fine_band = heuristic("inference.fine_band", 2.5);
    /// [places] Known to be inside, or outside, that are used: as far apart as can be.
    std::size_t max_places = heuristic("inference.max_places", 200);
    /// [cells] From the body's surface, beyond which it has left a mark.
    double off_cells = heuristic("inference.off_cells", 2);
    /// [of the marks] That a body may leave.
    double max_off = heuristic("inference.max_off", 0.15);
    /// [marks] Of fewer none is called wrong: a body of so few lacks parts.
    std::size_t wrong_from_marks = heuristic("inference.wrong_from_marks", 40);
    /// [of the marks] That are thought to be wrong before anything is known.
    double wrong_prior = heuristic("inference.wrong_prior", 0.05);
    /// [cells] From right marks to the body, in the mean.
    double usual_off = heuristic("inference.usual_off", 0.3);
    /// [of the marks] That may be wrong: where more seem to be it is the body that is.
    double max_wrong = heuristic("inference.max_wrong", 0.2);
    /// [spacings] Within which two other suspects say that a mark is right, and the body lacks a part.
    double beside_spacings = heuristic("inference.beside_spacings", 3);
    /// [rounds] In which wrong marks are left out.
    int wrong_rounds = heuristic("inference.wrong_rounds", 4);
    /// [voxels] From a guess to a mark that it misses; at least half of the widest spacing.
    double missed_voxels = heuristic("inference.missed_voxels", 1.5);
    /// [of what it misses a mark by] Within which a guess is redrawn.
    double redrawn = heuristic("inference.redrawn", 1.8);
    /// [voxels] By which a guess misses a mark, at most.
    double farthest_miss = heuristic("inference.farthest_miss", 30);
    /// [bits] That an image which redraws a guess tells of its sides.
    double redraw_bits = heuristic("inference.redraw_bits", 0.3);
    /// [Dice] Of guess and body, above which they are one.
    double agreement = heuristic("inference.agreement", 0.9);
    /// [1 - Dice] Of a result whose error times its area is its volume: by 118 runs of 20 structures with 20, 60 and
    /// 300 marks; 66 runs of 11 others, which were not looked at, lie in the interval in 92 %.
    double expected_scale = heuristic("inference.expected_scale", 0.47);
    /// [power] With which 1 - Dice grows with that error.
    double expected_power = heuristic("inference.expected_power", 1.15);
    /// [ratio] Of 1 - Dice to what is expected, which it exceeds or falls below by in one of twenty runs each.
    double expected_factor = heuristic("inference.expected_factor", 2);
};
COVOL_HEURISTICS InferenceHeuristics kInference{};

}  // namespace covol
