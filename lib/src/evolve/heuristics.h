#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristic.h"

namespace covol {

/// Time steps: evolve.cpp. An automatic step grows while the surface moves by little and shrinks when it moves by much.
struct EvolveHeuristics {
    /// [fraction of the motion that counts as steady] A leaf that moves by less in a step becomes inactive.
    double inactive_fraction = heuristic("evolve.inactive_fraction", 0.2);
    /// [steps] Between two redistancings of a tracked band.
    int cycle = heuristic("evolve.cycle", 3);
    /// [voxels a step] Below it the time step grows.
    double slow_motion = heuristic("evolve.slow_motion", 0.1);
    /// [voxels a step] Above it the time step shrinks.
    double fast_motion = heuristic("evolve.fast_motion", 0.4);
    /// [ratio] Factor by which the time step grows or shrinks.
    double tau_growth = heuristic("evolve.tau_growth", 1.5);
    /// [h] Maximum automatic time step.
    double largest_tau = heuristic("evolve.largest_tau", 10.0);
};
COVOL_HEURISTICS EvolveHeuristics kEvolve{};

/// When a band has to follow the surface: motion.cpp.
struct MotionHeuristics {
    /// [voxels] Mean motion in a leaf at which the surface has left the band's middle.
    double left_by = heuristic("motion.left_by", 0.75);
    /// [voxels] Mean motion in a leaf at which it is about to leave the band's middle.
    double leaving_by = heuristic("motion.leaving_by", 0.4);
    /// [fraction of the leaves with the surface in them] Leaves that it must have left before the band follows.
    double fraction_left = heuristic("motion.fraction_left", 0.1);
    /// [crossed edges] Minimum divisor of a leaf's mean motion, because a mean over fewer is unreliable.
    int few_crossings = heuristic("motion.few_crossings", 32);
    /// [voxels] Depth of a voxel whose change of sign, anywhere, makes the band follow.
    float deep = heuristic("motion.deep", 2.0F);
};
COVOL_HEURISTICS MotionHeuristics kMotion{};

/// The linear system: band_solver.cpp.
struct SolverHeuristics {
    /// [sweeps] Of a leaf per visit: the second costs a fifth and saves a third of the visits.
    int inner_sweeps = heuristic("solver.inner_sweeps", 2);
    /// [factor] Maximum over-relaxation.
    double max_omega = heuristic("solver.max_omega", 1.9);
    /// [ratio] Growth of the residual at which over-relaxation is abandoned.
    double diverged = heuristic("solver.diverged", 10.0);
    /// [fraction of the residual aimed at] A leaf with a smaller residual is not visited.
    double local_goal = heuristic("solver.local_goal", 0.5);
};
COVOL_HEURISTICS SolverHeuristics kSolver{};

}  // namespace covol
