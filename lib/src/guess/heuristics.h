#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include <cstddef>

#include "base/heuristic.h"

namespace covol {

/// The guess from marks: guess.cpp.
struct GuessHeuristics {
    /// [voxels] Within the section by more: a mark in the cut.
    double inside_voxels = heuristic("guess.inside_voxels", 1.5);
    /// [of a distance's slope] At a section whose body ends right beyond it.
    double min_slope = heuristic("guess.min_slope", 0.05);
    /// [rounds] Of telling marks in the cut from marks on the surface.
    int cut_rounds = heuristic("guess.cut_rounds", 2);
    /// [ellipsoids around the marks] A surface that goes on beyond does not close; half a ball's marks close it
    /// within 2.
    double runs_on = heuristic("guess.runs_on", 3.0);
    /// [ellipsoids around the marks] Where it is held then.
    double held_at = heuristic("guess.held_at", 1.5);
    /// [rounds] Of holding seeds that lie on the wrong side.
    int seed_rounds = heuristic("guess.seed_rounds", 4);
    /// [marks] Nearest to one in a cut, in whose directions there may be a way out.
    std::size_t around = heuristic("guess.around", 8);
    /// [pi] The least angle that is one: beside a straight line of marks it is pi.
    double way_out = heuristic("guess.way_out", 5.0 / 6);
    /// [of the marks in a cut] Without a way out, less of its outline: of twelve marks and more all over it they are a
    /// sixth and more.
    double surrounded_fraction = heuristic("guess.surrounded_fraction", 0.125);
    /// [marks] Off the cuts, to say what is inside of them; in a cut, for an outline.
    std::size_t min_outline = heuristic("guess.min_outline", 8);
};
COVOL_HEURISTICS GuessHeuristics kGuess{};

/// A guess moved through marks: guess_correction.cpp.
struct CorrectionHeuristics {
    /// [voxels] Of marks whose precision is not given.
    double precision_voxels = heuristic("correction.precision_voxels", 0.5);
    /// [distances between mark and guess] Radius of a bump that moves the guess inward: above 2.11 the level set stays
    /// one (its slope does not change sign), see the public header.
    double radius_of_residual = heuristic("correction.radius_of_residual", 3.0);
    /// [distances between mark and guess] The same outward, where a wide bump inflates what is right beside a part that
    /// is missing (tests/bench/marks/correction.py).
    double radius_outward = heuristic("correction.radius_outward", 2.2);
    /// [ratio] Bumps whose radii differ by less are solved for together.
    double level_ratio = heuristic("correction.level_ratio", 2.0);
    /// [voxels] How far beyond a seed the surface is put.
    double seed_depth_voxels = heuristic("correction.seed_depth_voxels", 0.5);
    /// [rounds] Moving for one seed may bring the next to the wrong side.
    int seed_rounds = heuristic("correction.seed_rounds", 4);
    /// [voxels] The clamped distance is taken below this.
    double exact_voxels = heuristic("correction.exact_voxels", 2.0);
};
COVOL_HEURISTICS CorrectionHeuristics kCorrection{};

/// The surface through marks, whole and in parts: marks_surface.cpp. Time, not accuracy, sets the numbers of marks: the
/// whole takes the cube of its number, a part the cube of its own.
struct MarksSurfaceHeuristics {
    /// [marks] Whose normals are searched for from nothing.
    std::size_t oriented = heuristic("marks_surface.oriented", 100);
    /// [marks] Of the whole.
    std::size_t whole = heuristic("marks_surface.whole", 300);
    /// [marks] Of a part.
    std::size_t patch_marks = heuristic("marks_surface.patch_marks", 48);
    /// [marks] Of a part, nearest to its centre, that need no part of their own.
    std::size_t core_marks = heuristic("marks_surface.core_marks", 12);
    /// [ratio] Between variances of the marks that are tried.
    double variance_step = heuristic("marks_surface.variance_step", 4);
    /// [parts] That are asked how imprecise marks are.
    std::size_t tried_parts = heuristic("marks_surface.tried_parts", 16);
    /// [of the given variance] Below which marks are exact.
    double min_factor = heuristic("marks_surface.min_factor", 1e-3);
    /// [of a part's weight at its centre] Of the whole among parts.
    double whole_weight = heuristic("marks_surface.whole_weight", 1e-3);
};
COVOL_HEURISTICS MarksSurfaceHeuristics kMarks{};

/// Normals of least energy: variational.cpp. Huang, Carr and Ju, Variational implicit point set surfaces, ACM Trans.
/// Graph. 38(4), 2019, has the energy; starts and lattice are ours.
struct VariationalHeuristics {
    /// [modes] Of the energy that are tried as directions of the normals.
    int modes = heuristic("variational.modes", 3);
    /// [vectors] Of the subspace iteration for them.
    int subspace = heuristic("variational.subspace", 6);
    /// [steps] Of it.
    int subspace_steps = heuristic("variational.subspace_steps", 12);
    /// [marks] Neighbours, to have a middle.
    double min_local = heuristic("variational.min_local", 6);
    /// [directions] Around the marks, in which the surface may not go on.
    int directions = heuristic("variational.directions", 64);
    /// [steps] Of L-BFGS, at most.
    int min_energy_steps = heuristic("variational.min_energy_steps", 500);
    /// [rounds] Of finding the amplitude against which precision counts.
    int amplitude_rounds = heuristic("variational.amplitude_rounds", 3);
    /// [ratio] Of the least to the largest variance of marks in one plane.
    double flat = heuristic("variational.flat", 1e-8);
    /// [of the amplitude] Keeps the matrix regular where marks coincide.
    double min_lambda = heuristic("variational.min_lambda", 1e-9);
};
COVOL_HEURISTICS VariationalHeuristics kVariational{};

}  // namespace covol
