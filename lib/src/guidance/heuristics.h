#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristic.h"

namespace covol {

/// Guidance by the image between the marks: guidance.cpp.
struct GuidanceHeuristics {
    /// [iterations] In the second one the normals, and inside and outside, are known better.
    int iterations = heuristic("guidance.iterations", 2);
    /// [voxels] On both sides of the surface, within which profiles are read.
    double width = heuristic("guidance.width", 14.0);
    /// [voxels] Around that, within which the image is smoothed in advance for the next iteration.
    double moves = heuristic("guidance.moves", 4.0);
    /// [voxels] Maximum offset in one iteration.
    double longest_offset = heuristic("guidance.longest_offset", 12.0);
    /// [voxels] Width of a patch of the surface with a single offset.
    double patch_width = heuristic("guidance.patch_width", 2.0);
    /// [patches] In the marks' spacing: offsets are not resolved at shorter lengths.
    double patches_per_spacing = heuristic("guidance.patches_per_spacing", 4);
    /// [voxels] Distance from a mark at which both sides are compared, to distinguish lines from steps.
    double sides = heuristic("guidance.sides", 3.0);
    /// [rounds] Of averaging normals, over about two voxels.
    int normal_rounds = heuristic("guidance.normal_rounds", 6);
    /// [marks] Minimum from which the border's profile is learnt.
    std::size_t fewest_marks = heuristic("guidance.fewest_marks", 8);
    /// [marks] Maximum used for cross-validation.
    std::size_t max_marks = heuristic("guidance.max_marks", 400);
    /// [of a unit field] Minimum response: a field that hardly follows the image does not show how good the image is.
    double min_response = heuristic("guidance.min_response", 0.25);
    /// [marks] Weight of the assumption that the image is equally good everywhere.
    double weight_of_all = heuristic("guidance.weight_of_all", 4);
    /// [variances] Number of priors that are compared, each half of the previous one.
    int priors = heuristic("guidance.priors", 5);
    /// [d² / (2 R)] Error of a surface of minimum bending energy, at distance d from marks on a body of size R: about a
    /// third of the sagitta.
    double fraction_of_sagitta = heuristic("guidance.fraction_of_sagitta", 0.3);
};
COVOL_HEURISTICS GuidanceHeuristics kGuide{};

/// The border's profile and its reliability: learning.cpp.
struct LearningHeuristics {
    /// [marks] Minimum for profiles that vary with the position.
    std::size_t marks_for_places = heuristic("learning.marks_for_places", 40);
    /// [of the way from the surface] Minimum distance to the surface, relative to the way along the normal, of a
    /// position that belongs to this part of the surface; less a voxel.
    double own_fraction = heuristic("learning.own_fraction", 0.7);
    /// [marks] Approximate number within the radius of a local profile.
    int neighbours = heuristic("learning.neighbours", 12);
};
COVOL_HEURISTICS LearningHeuristics kLearning{};

/// Counts of intensity by depth: border_profile.cpp.
struct BorderProfileHeuristics {
    /// [steps of a fourth of a voxel] Blur for the error of marks; samples closer than a voxel are not independent.
    double depth_blur = heuristic("border.depth_blur", 1.4);
    /// [levels of intensity] Blur over the 24 levels.
    double level_blur = heuristic("border.level_blur", 1.0);
    /// [places] Weight of the more general counts as a prior.
    double belief = heuristic("border.belief", 2.0);
};
COVOL_HEURISTICS BorderProfileHeuristics kBorder{};

/// The field of offsets, and the distance that it modifies: offset_field.cpp, wide_distance.cpp.
struct OffsetFieldHeuristics {
    /// [rounds] Of reweighting marks and image.
    int rounds = heuristic("offset_field.rounds", 4);
    /// [voxels] The start's band, without the part that its clamping affects.
    double own_voxels = heuristic("offset_field.own_voxels", 2.5);
};
COVOL_HEURISTICS OffsetFieldHeuristics kOffsets{};

/// From one image of a time-lapse to the next one: motion.cpp.
struct MotionHeuristics {
    /// [voxels] Maximum movement of the whole surface along an axis from one image to the next.
    double farthest = heuristic("motion.farthest", 12.0);
    /// [voxels] Maximum additional movement of a part of it.
    double range = heuristic("motion.range", 6.0);
    /// [voxels] On both sides of the surface, which are compared between images.
    double window = heuristic("motion.window", 4.0);
    /// [voxels] Precision of a translation, and minimum deviation of offsets.
    double finest_step = heuristic("motion.finest_step", 0.03);
    /// [of the mismatch] Maximum that a translation may leave; otherwise it is rejected.
    double min_gain = heuristic("motion.min_gain", 0.9);
    /// [of the samples] Minimum that lie in the image after a translation.
    double min_seen = heuristic("motion.min_seen", 0.8);
    /// [patches] Maximum from which a translation is computed.
    std::size_t max_patches = heuristic("motion.max_patches", 2000);
    /// [of the variance of intensity] Minimum noise.
    double min_noise = heuristic("motion.min_noise", 1e-6);
    /// [square steps of a fourth of a voxel] Minimum variance of one patch's offset.
    double variance = heuristic("motion.variance", 0.25);
    /// [of the radius of the body] Correlation length of the offsets.
    double alike = heuristic("motion.alike", 0.5);
    /// [passes] Of matching, each starting from the result of the previous one.
    int passes = heuristic("motion.passes", 2);
    /// [rounds] In which the deviation of offsets is estimated.
    int rounds = heuristic("motion.rounds", 4);
    /// [voxels] Smaller maximum offsets are ignored.
    double still = heuristic("motion.still", 0.02);
};
COVOL_HEURISTICS MotionHeuristics kMotion{};

}  // namespace covol
