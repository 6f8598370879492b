#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// Guidance by the image between the marks: guidance.cpp.
struct GuidanceHeuristics {
    /// [iterations] Of guidance, and of the match between a surface and the next image of a time-lapse. The second
    /// iteration starts closer to the border, with more accurate normals.
    int iterations = heuristic("guidance.iterations", 2);
    /// [voxels] Maximum offset in one iteration, and maximum movement along an axis from one image to the next.
    double farthest = heuristic("guidance.farthest", 12.0);
    /// [voxels] Width of a patch of the surface with a single offset.
    double patch_width = heuristic("guidance.patch_width", 2.0);
    /// [patches] Maximum number of patches side by side within the spacing of the marks, because offsets are not
    /// resolved at shorter lengths. If marks are farther apart, the patches are wider.
    double patches_per_spacing = heuristic("guidance.patches_per_spacing", 4);
    /// [marks] Weight of the prior when a distribution or an error is estimated from some marks. For nearby marks the
    /// prior is the estimate from all marks.
    double belief = heuristic("guidance.belief", 4.0);
    /// [levels of intensity] Standard deviation of the blur of counts over the 24 levels.
    double level_blur = heuristic("guidance.level_blur", 1.0);
    /// [d² / (2 R)] Minimum assumed error of a surface of minimum bending energy at the distance d from marks on a body
    /// of size R: about a third of the sagitta.
    double fraction_of_sagitta = heuristic("guidance.fraction_of_sagitta", 0.3);
};
COVOL_HEURISTICS GuidanceHeuristics kGuide{};

/// The transfer of a surface from one image of a time-lapse to the next: motion.cpp.
struct TimeLapseHeuristics {
    /// [of the radius of the body] Correlation length of the offsets.
    double alike = heuristic("time_lapse.alike", 0.5);
};
COVOL_HEURISTICS TimeLapseHeuristics kTimeLapse{};

}  // namespace covol
