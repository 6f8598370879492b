#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include <cstddef>

#include "base/heuristic.h"

namespace covol {

/// What the image shows between the marks: guidance.cpp.
struct GuidanceHeuristics {
    /// [iterations] Normals, and what is inside and outside, are better known the second time.
    int iterations = heuristic("guidance.iterations", 2);
    /// [voxels] To both sides of the surface in which profiles are read.
    double width = heuristic("guidance.width", 14.0);
    /// [voxels] Around that, where the image is smoothed at once for the next iteration.
    double moves = heuristic("guidance.moves", 4.0);
    /// [voxels] In one iteration.
    double longest_offset = heuristic("guidance.longest_offset", 12.0);
    /// [voxels] Of a patch of the surface that has one offset.
    double patch_width = heuristic("guidance.patch_width", 2.0);
    /// [patches] In the marks' spacing: offsets that vary within less are not sought.
    double patches_per_spacing = heuristic("guidance.patches_per_spacing", 4);
    /// [voxels] Beside a mark, to tell lines from steps.
    double sides = heuristic("guidance.sides", 3.0);
    /// [rounds] Of averaging normals, about two voxels.
    int normal_rounds = heuristic("guidance.normal_rounds", 6);
    /// [marks] That the image is learnt from.
    std::size_t fewest_marks = heuristic("guidance.fewest_marks", 8);
    /// [marks] That are tested by leaving them out.
    std::size_t max_marks = heuristic("guidance.max_marks", 400);
    /// [of a unit field] A field that hardly follows the image does not tell how good the image is.
    double min_response = heuristic("guidance.min_response", 0.25);
    /// [marks] Worth of belief that the image is as good everywhere.
    double belief_in_all = heuristic("guidance.belief_in_all", 4);
    /// [variances] That are tried, each half of the one before.
    int priors = heuristic("guidance.priors", 5);
    /// [d² / (2 R)] Error of a surface that bends least, at distance d from marks on a body of size R: about a third of
    /// the sagitta.
    double fraction_of_sagitta = heuristic("guidance.fraction_of_sagitta", 0.3);
};
COVOL_HEURISTICS GuidanceHeuristics kGuide{};

/// The border's profile and how far it is believed: learning.cpp.
struct LearningHeuristics {
    /// [marks] Fewer say nothing of how the profile varies.
    std::size_t marks_for_places = heuristic("learning.marks_for_places", 40);
    /// [of the way from the surface] Distance from which on a place is its own part's; less a voxel.
    double own_fraction = heuristic("learning.own_fraction", 0.7);
    /// [marks] Within the radius of a local profile, about.
    int neighbours = heuristic("learning.neighbours", 12);
};
COVOL_HEURISTICS LearningHeuristics kLearning{};

/// Counts of brightness by depth: border_profile.cpp.
struct BorderProfileHeuristics {
    /// [steps of a fourth of a voxel] A mark's jitter, and samples closer than a voxel are no two samples.
    double depth_blur = heuristic("border.depth_blur", 1.4);
    /// [levels of brightness] Of the 24.
    double level_blur = heuristic("border.level_blur", 1.0);
    /// [places] Worth of belief in the more general counts.
    double belief = heuristic("border.belief", 2.0);
};
COVOL_HEURISTICS BorderProfileHeuristics kBorder{};

/// The field of offsets, and the distance that it moves: offset_field.cpp, wide_distance.cpp.
struct OffsetFieldHeuristics {
    /// [rounds] Of reweighting marks and image.
    int rounds = heuristic("offset_field.rounds", 4);
    /// [voxels] The start's band, less what its clamp touches.
    double own_voxels = heuristic("offset_field.own_voxels", 2.5);
};
COVOL_HEURISTICS OffsetFieldHeuristics kOffsets{};

/// From one image of a time-lapse to the next one: motion.cpp.
struct MotionHeuristics {
    /// [voxels] That a whole surface moves along an axis from one image to the next.
    double farthest = heuristic("motion.farthest", 12.0);
    /// [voxels] That a part of it moves beside that.
    double range = heuristic("motion.range", 6.0);
    /// [voxels] To both sides of the surface that it is recognised by.
    double window = heuristic("motion.window", 4.0);
    /// [voxels] To which a translation is found, and the least deviation of offsets.
    double finest_step = heuristic("motion.finest_step", 0.03);
    /// [of the mismatch] A translation leaves less.
    double min_gain = heuristic("motion.min_gain", 0.9);
    /// [of the samples] That are in the image after a translation.
    double min_seen = heuristic("motion.min_seen", 0.8);
    /// [patches] That a translation is found from.
    std::size_t max_patches = heuristic("motion.max_patches", 2000);
    /// [of the variance of brightness] That its noise has at least.
    double min_noise = heuristic("motion.min_noise", 1e-6);
    /// [square steps of a fourth of a voxel] Of one patch's offset, at least.
    double variance = heuristic("motion.variance", 0.25);
    /// [of the radius of the body] Over which offsets are alike.
    double alike = heuristic("motion.alike", 0.5);
    /// [passes] In which it is matched, each from where the last one found it.
    int passes = heuristic("motion.passes", 2);
    /// [rounds] In which the deviation of offsets is estimated.
    int rounds = heuristic("motion.rounds", 4);
    /// [voxels] Less is no offset.
    double still = heuristic("motion.still", 0.02);
};
COVOL_HEURISTICS MotionHeuristics kMotion{};

}  // namespace covol
