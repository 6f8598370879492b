#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristic.h"

namespace covol {

/// The guess from marks: guess.cpp.
struct GuessHeuristics {
    /// [voxels] Depth within the section beyond which a mark counts as part of the cut.
    double inside_voxels = heuristic("guess.inside_voxels", 1.5);
    /// [of a distance's slope] Minimum slope at a section whose body ends right beyond it.
    double min_slope = heuristic("guess.min_slope", 0.05);
    /// [rounds] Of separating marks in the cut from marks on the surface.
    int cut_rounds = heuristic("guess.cut_rounds", 2);
    /// [ellipsoids around the marks] A surface that extends beyond is not closed; the surface through marks on half a
    /// ball closes within 2.
    double runs_on = heuristic("guess.runs_on", 3.0);
    /// [ellipsoids around the marks] Position of the constraints that close it.
    double held_at = heuristic("guess.held_at", 1.5);
    /// [rounds] Of adding constraints at seeds that lie on the wrong side.
    int seed_rounds = heuristic("guess.seed_rounds", 4);
    /// [marks] Number of the nearest ones to a mark in a cut, between whose directions a gap is searched.
    std::size_t around = heuristic("guess.around", 8);
    /// [pi] Minimum angle of such a gap: beside a straight line of marks it is pi.
    double way_out = heuristic("guess.way_out", 5.0 / 6);
    /// [of the marks in a cut] Maximum without a gap, for marks along an outline: of twelve or more marks all over the
    /// cut at least a sixth have none.
    double surrounded_fraction = heuristic("guess.surrounded_fraction", 0.125);
    /// [marks] Minimum outside of the cuts, to determine the sections; and minimum in a cut, for an outline.
    std::size_t min_outline = heuristic("guess.min_outline", 8);
};
COVOL_HEURISTICS GuessHeuristics kGuess{};

/// A guess corrected by marks: guess_correction.cpp.
struct CorrectionHeuristics {
    /// [voxels] Of marks whose precision is not given.
    double precision_voxels = heuristic("correction.precision_voxels", 0.5);
    /// [distances between mark and guess] Radius of a bump that moves the guess inward: above 2.11 the result is still
    /// a level set (its slope does not change sign), see the public header.
    double radius_of_residual = heuristic("correction.radius_of_residual", 3.0);
    /// [distances between mark and guess] The same outward, where a wide bump inflates the correct surface beside a
    /// missing part (tests/bench/marks/correction.py).
    double radius_outward = heuristic("correction.radius_outward", 2.2);
    /// [ratio] Bumps whose radii differ by less are solved together.
    double level_ratio = heuristic("correction.level_ratio", 2.0);
    /// [voxels] Distance beyond a seed at which the surface is placed.
    double seed_depth_voxels = heuristic("correction.seed_depth_voxels", 0.5);
    /// [rounds] Of adding seeds: a correction for one may move another to the wrong side.
    int seed_rounds = heuristic("correction.seed_rounds", 4);
    /// [voxels] Below this the clamped distance is used.
    double exact_voxels = heuristic("correction.exact_voxels", 2.0);
};
COVOL_HEURISTICS CorrectionHeuristics kCorrection{};

/// The surface through marks, whole and in parts: marks_surface.cpp. The numbers of marks are limited by time, not
/// accuracy: the whole takes the cube of its number, a part the cube of its own.
struct MarksSurfaceHeuristics {
    /// [marks] Maximum whose normals are optimised without initial values.
    std::size_t oriented = heuristic("marks_surface.oriented", 100);
    /// [marks] Maximum in the whole.
    std::size_t whole = heuristic("marks_surface.whole", 300);
    /// [marks] Number in a part.
    std::size_t patch_marks = heuristic("marks_surface.patch_marks", 48);
    /// [marks] Of a part, closest to its centre, that need no part of their own.
    std::size_t core_marks = heuristic("marks_surface.core_marks", 12);
    /// [ratio] Between the variances of the marks that are compared.
    double variance_step = heuristic("marks_surface.variance_step", 4);
    /// [parts] Number from which the variance of the marks is estimated.
    std::size_t tried_parts = heuristic("marks_surface.tried_parts", 16);
    /// [of the given variance] Below this, marks are treated as exact.
    double min_factor = heuristic("marks_surface.min_factor", 1e-3);
    /// [of a part's weight at its centre] Weight of the whole among the parts.
    double whole_weight = heuristic("marks_surface.whole_weight", 1e-3);
};
COVOL_HEURISTICS MarksSurfaceHeuristics kMarks{};

/// Normals of minimum energy: variational.cpp. The energy is that of Huang, Carr and Ju, Variational implicit point set
/// surfaces, ACM Trans. Graph. 38(4), 2019; initial values and lattice are not from there.
struct VariationalHeuristics {
    /// [modes] Of the energy that are used as initial directions of the normals.
    int modes = heuristic("variational.modes", 3);
    /// [vectors] Of the subspace iteration for them.
    int subspace = heuristic("variational.subspace", 6);
    /// [steps] Of that iteration.
    int subspace_steps = heuristic("variational.subspace_steps", 12);
    /// [marks] Minimum number of neighbours for a meaningful centroid.
    double min_local = heuristic("variational.min_local", 6);
    /// [directions] Around the marks, in which the surface is tested for being closed.
    int directions = heuristic("variational.directions", 64);
    /// [steps] Maximum for L-BFGS.
    int min_energy_steps = heuristic("variational.min_energy_steps", 500);
    /// [rounds] Of estimating the amplitude, to which the precision is relative.
    int amplitude_rounds = heuristic("variational.amplitude_rounds", 3);
    /// [ratio] Of the minimum to the maximum variance along axes; below it the marks lie in one plane.
    double flat = heuristic("variational.flat", 1e-8);
    /// [of the amplitude] Minimum lambda; keeps the matrix regular if marks coincide.
    double min_lambda = heuristic("variational.min_lambda", 1e-9);
};
COVOL_HEURISTICS VariationalHeuristics kVariational{};

}  // namespace covol
