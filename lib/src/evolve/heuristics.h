#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include "base/heuristic.h"

namespace covol {

/// Steps in time: evolve.cpp. An automatic step grows while the surface moves by little and shrinks when it moves by
/// much.
struct EvolveHeuristics {
    /// [of the motion that counts as steady] A leaf that a step moves by less becomes inactive.
    double inactive_fraction = heuristic("evolve.inactive_fraction", 0.2);
    /// [steps] Between two redistancings of a tracked band.
    int cycle = heuristic("evolve.cycle", 3);
    /// [voxels a step] Below it the time step grows.
    double slow_motion = heuristic("evolve.slow_motion", 0.1);
    /// [voxels a step] Above it the time step shrinks.
    double fast_motion = heuristic("evolve.fast_motion", 0.4);
    /// [ratio] Of time steps.
    double tau_growth = heuristic("evolve.tau_growth", 1.5);
    /// [h] Largest automatic time step.
    double largest_tau = heuristic("evolve.largest_tau", 10.0);
};
COVOL_HEURISTICS EvolveHeuristics kEvolve{};

/// When a band has to follow: motion.cpp.
struct MotionHeuristics {
    /// [voxels] Motion over a leaf, on the average, that has left the band's middle.
    double left_by = heuristic("motion.left_by", 0.75);
    /// [voxels] The same, that is leaving it.
    double leaving_by = heuristic("motion.leaving_by", 0.4);
    /// [share of the leaves with the surface in them] That have left it; before that it is not worth while.
    double fraction_left = heuristic("motion.fraction_left", 0.1);
    /// [crossed edges] A leaf's average over fewer says little.
    int few_crossings = heuristic("motion.few_crossings", 32);
    /// [voxels] Depth of a voxel whose change of sign, anywhere, makes the band follow.
    float deep = heuristic("motion.deep", 2.0F);
};
COVOL_HEURISTICS MotionHeuristics kMotion{};

/// The linear system: band_solver.cpp.
struct SolverHeuristics {
    /// [sweeps] Of a leaf in a visit: the second costs a fifth and saves a third of the visits.
    int inner_sweeps = heuristic("solver.inner_sweeps", 2);
    /// [factor] Of over-relaxation, at most.
    double max_omega = heuristic("solver.max_omega", 1.9);
    /// [ratio] Growth of the residual at which over-relaxation is given up.
    double diverged = heuristic("solver.diverged", 10.0);
    /// [of the residual aimed at] A leaf is left alone below it.
    double local_goal = heuristic("solver.local_goal", 0.5);
};
COVOL_HEURISTICS SolverHeuristics kSolver{};

}  // namespace covol
