#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristics.h"

namespace covol {

/// Automatic choices: choices.cpp.
struct AutomaticHeuristics {
    /// [marks] Maximum number for a guess, or to correct a start. More take long, and are dense enough for tagging.
    std::size_t max_guess_marks = limit("automatic.max_guess_marks", 4000);
    /// [voxels] Displacement of a surface from which on it is noticeable: closer points are merged, and thicker layers
    /// of them are averaged.
    double noticeable_voxels = heuristic("automatic.noticeable_voxels", 0.25);
    /// [points] With fewer tagged points than this, the voxels are made smaller, so that the surface has as many voxels
    /// as with this number of points.
    double few_points = heuristic("automatic.few_points", 1000);
    /// [voxels] Maximum number on the six sides of the points' bounding box, to limit the time. Points around a ball
    /// give 35,000, around thin parts ten times as many; points on curves would give more, the closer they lie
    /// together.
    double max_box_voxels = limit("automatic.max_box_voxels", 3e5);
    /// [voxels] Maximum number of voxels on the surface per point; clouds on closed surfaces have 4 to 8.
    double max_facets = limit("automatic.max_facets", 20);
    /// [voxels] Weight of curvature after tagging, for contours and for a guess.
    double tag_delta_voxels = heuristic("automatic.tag_delta_voxels", 0.25);
};
COVOL_HEURISTICS AutomaticHeuristics kAutomatic{};

/// The flow of a run: solve/.
struct FlowHeuristics {
    /// [voxels a step] Minimum tolerance of a flow whose result is the start of another flow. A larger value would end
    /// it too early, because a surface far from edges and points also moves slowly.
    double rough_tolerance = heuristic("flow.rough_tolerance", 5e-3);
    /// [voxels] Automatic time step of the flow on a coarse level. Also the factor by which the time step of the first
    /// flow after tagging, approach(), is longer than that of the main flow, if the band moves with the surface.
    double rough_tau = heuristic("flow.rough_tau", 2.0);
    /// [voxels] Minimum width of a domain for an automatic coarse level: in a smaller one it saves little time, and
    /// thin structures may be lost.
    int min_coarsened = limit("flow.min_coarsened", 64);
    /// [steps] Maximum number of steps of the first flow after tagging, in which only the points attract.
    int approach_steps = limit("flow.approach_steps", 40);
    /// [distances between marked slices] Range within which the image may move the body between contours.
    double contour_range = heuristic("flow.contour_range", 0.25);
};
COVOL_HEURISTICS FlowHeuristics kFlow{};

/// Warnings about marks: doubts.cpp and result/report.cpp.
struct DoubtsHeuristics {
    /// [radii of the largest ball inside a guess] Distance of a mark from the guess, above which the guess is
    /// unreliable there: of 60 masks of five thin structures that lacked a quarter, with 5 to 30 marks, 15 had a mark
    /// farther away; correction made 9 of these worse, and 3 of the other masks.
    double far_from_guess = heuristic("doubts.far_from_guess", 4.0);
    /// [probability] Minimum probability that the image varies more at a mark than beside it, for the image to show the
    /// marked border: 0.5 for an unrelated image. Of 146 right results from 20 to 300 marks or from contours of 33
    /// structures, none is below it; of 567 wrong results of shifted, mirrored, scaled or random marks, 368 are.
    double image_support = heuristic("doubts.image_support", 0.55);
    /// [nats] Gain of guidance per mark, from which on the marks fit the image even in a uniform region: at least 0.96
    /// for marks on the middle of wide lines, at most 0.58 for the wrong results that image_support finds.
    double clear_gain = heuristic("doubts.clear_gain", 0.5);
    /// [Dice] Expected Dice below which a result is doubted: of 26 results with less than 0.8, 24 were below it, of 94
    /// with more than 0.9, two.
    double min_expected_dice = heuristic("doubts.min_expected_dice", 0.87);
    /// [ratio] Estimated noise divided by the deviation of twelve neighbouring points from a sheet. Above this ratio,
    /// folds were mistaken for noise: up to 1.5 for noisy thin sheets, 2.0 to 11 for folds, shells and
    /// misaligned scans.
    double folded_noise = heuristic("doubts.folded_noise", 1.75);
    /// [marks] Minimum number per handle of a surface through marks with several handles; with fewer, these are
    /// doubted.
    double marks_of_handle = heuristic("doubts.marks_of_handle", 100);
};
COVOL_HEURISTICS DoubtsHeuristics kDoubts{};

/// Starts of a run: segment/start.
struct StartsHeuristics {
    /// [voxels] Weight of curvature for a start that was grown to the image's edges.
    double grown_delta_voxels = heuristic("starts.grown_delta_voxels", 0.1);
};
COVOL_HEURISTICS StartsHeuristics kStarts{};

}  // namespace covol
