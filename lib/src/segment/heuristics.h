#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristic.h"

namespace covol {

/// Automatic choices: choices.cpp.
struct AutomaticHeuristics {
    /// [marks] Maximum for a guess, or for the correction of a start: more take long, and are dense enough for tagging.
    std::size_t max_guess_marks = heuristic("automatic.max_guess_marks", 4000);
    /// [voxels] Range of the points after tagging with an image; farther from the marks the image decides. Measured on
    /// brain, spleen and nucleus with 300 points each.
    double tag_attraction_voxels = heuristic("automatic.tag_attraction_voxels", 8.0);
    /// [points] With fewer tagged points, the voxel size is reduced until the surface has as many voxels as with this
    /// many.
    double few_points = heuristic("automatic.few_points", 1000);
    /// [voxels] Maximum on the sides of the box around few points, to limit the time. A ball has 35,000, thin parts ten
    /// times as many; points on curves would give more, the closer they lie.
    double max_box_voxels = heuristic("automatic.max_box_voxels", 3e5);
    /// [cells of the indicator] Voxel size of a cloud that encloses nothing, or fills a solid.
    double view_voxel = heuristic("automatic.view_voxel", 0.5);
    /// [voxels] Maximum number on the surface for each point; clouds on closed surfaces have 4 to 8.
    double max_facets = heuristic("automatic.max_facets", 20);
    /// [noises] Minimum voxel size of a cloud.
    double cloud_noise = heuristic("automatic.cloud_noise", 0.6);
    /// [voxels] Seeds closer than this count as one position.
    double same_seed_voxels = heuristic("automatic.same_seed_voxels", 1e-3);
    /// [voxels] Points closer than this are merged, which does not move the surface noticeably.
    double merge_voxels = heuristic("automatic.merge_voxels", 0.25);
    /// [voxels] Range of the points after starts other than tagging.
    double attraction_voxels = heuristic("automatic.attraction_voxels", 5.0);
    /// [voxels] Weight of curvature after tagging with an image.
    double tag_delta_voxels = heuristic("automatic.tag_delta_voxels", 0.5);
    /// [voxels] Presmoothing of the image after tagging.
    double tag_sigma_voxels = heuristic("automatic.tag_sigma_voxels", 2.0);
    /// [times the distance of 99 % of the points from their middle] A point farther away is reported as a mistake if no
    /// lattice can hold it.
    double wild_point = heuristic("automatic.wild_point", 1000);
    /// [voxels] Radius within which the layers of a scan are averaged.
    double scan_radius_voxels = heuristic("automatic.scan_radius_voxels", 2.5);
    /// [voxels] A layer of points thicker than this is averaged.
    double noisy_fraction = heuristic("automatic.noisy_fraction", 0.3);
};
COVOL_HEURISTICS AutomaticHeuristics kAutomatic{};

/// Distance and edge detector of a run: solve/fields.cpp.
struct FieldsHeuristics {
    /// [voxels] Voxel size of the coarse distance field that determines the width of the distance tube.
    double coarse_factor = heuristic("fields.coarse_factor", 8.0);
    /// [sigmas] Distance from a mark at which both sides are compared, to distinguish lines from borders.
    double sides_sigmas = heuristic("fields.sides_sigmas", 3.0);
    /// [of the way to a side] Minimum depth inside the body of the position on the inner side.
    double side_depth = heuristic("fields.side_depth", 0.7);
    /// [marks] Number that is evaluated.
    std::size_t feature_marks = heuristic("fields.feature_marks", 4000);
};
COVOL_HEURISTICS FieldsHeuristics kFields{};

/// The domain: problem.h and start/.
struct JobHeuristics {
    /// [voxels] Margin between D and the domain's boundary, for points alone.
    double margin_voxels = heuristic("job.margin_voxels", 6.0);
};
COVOL_HEURISTICS JobHeuristics kJob{};

/// The flow of a run: solve/.
struct FlowHeuristics {
    /// [tau] Time step of the approach by the points alone.
    double approach_tau = heuristic("flow.approach_tau", 3.0);
    /// [steps] Maximum number of steps of that approach.
    int approach_steps = heuristic("flow.approach_steps", 40);
    /// [voxels a step] Tolerance at which that approach ends.
    double approach_tolerance = heuristic("flow.approach_tolerance", 0.01);
    /// [voxels] Maximum depth to which the surface may sink below the start if the points enclose nothing.
    double hold_depth = heuristic("flow.hold_depth", 0.75);
    /// [volumes of the grown start] A flow whose result is smaller has lost the edges.
    double min_of_grown = heuristic("flow.min_of_grown", 0.5);
    /// [voxels] Increase of the mean distance to the marks over that of the start, above which the flow has left them.
    double leaves_voxels = heuristic("flow.leaves_voxels", 0.25);
    /// [distances between marked slices] Range within which the image may move the body between contours in one pass.
    double contour_range = heuristic("flow.contour_range", 0.25);
    /// [passes] Number of guidance passes between contours, each starting from the result of the previous one.
    int contour_passes = heuristic("flow.contour_passes", 3);
    /// [voxels] The same range for a body inferred from marks and image, which lies close to the result.
    double inferred_range = heuristic("flow.inferred_range", 1.5);
};
COVOL_HEURISTICS FlowHeuristics kFlow{};

/// The coarse level: solve/coarse_level.cpp.
struct CoarseLevelHeuristics {
    /// [ratio] Of its voxel size to that of the next finer level.
    double refinement = heuristic("coarse_level.refinement", 2.0);
    /// [voxels of the coarse level] Minimum presmoothing of the image.
    double min_coarse_sigma = heuristic("coarse_level.min_coarse_sigma", 0.5);
    /// [voxels of the coarse level] Minimum range of the points.
    double min_coarse_attraction = heuristic("coarse_level.min_coarse_attraction", 3.0);
    /// [voxels a step] Minimum tolerance; not larger, because a surface far from edges and points moves slowly, too.
    double coarse_tolerance = heuristic("coarse_level.coarse_tolerance", 5e-3);
    /// [voxels of the coarse level] Time step, if it is automatic: large, since the result is only a start.
    double coarse_tau = heuristic("coarse_level.coarse_tau", 2.0);
    /// [voxels of the coarse level] Distance outside of the coarse result at which the fine level starts.
    double step_back = heuristic("coarse_level.step_back", 2.0);
    /// [voxels] In a smaller domain a coarse level saves little time, and thin structures may be lost.
    int min_coarsened = heuristic("coarse_level.min_coarsened", 64);
};
COVOL_HEURISTICS CoarseLevelHeuristics kCoarse{};

/// Warnings about marks: doubts.cpp and result/report.cpp.
struct DoubtsHeuristics {
    /// [longest edges of the image's voxel] Maximum plausible error of a mark placed by hand.
    double off_voxels = heuristic("doubts.off_voxels", 2.0);
    /// [voxels] Mean signed distance of the marks from the surface, above which there is a warning.
    double bias_voxels = heuristic("doubts.bias_voxels", 0.25);
    /// [standard errors of the mean] The same.
    double bias_errors = heuristic("doubts.bias_errors", 4.0);
    /// [noises of a cloud] Maximum plausible error of a point; farther points belong to another surface.
    double off_noise = heuristic("doubts.off_noise", 4.0);
    /// [diagonals of the marks' box] Distance from every mark, beyond which the marks do not support the surface any
    /// more.
    double far_diagonals = heuristic("doubts.far_diagonals", 0.5);
    /// [fraction of the surface] Maximum that lies so far from every mark.
    double far_fraction = heuristic("doubts.far_fraction", 0.05);
    /// [fraction of the marks] Maximum that a surface may miss.
    double missed_fraction = heuristic("doubts.missed_fraction", 0.1);
    /// [radii of the largest ball inside a guess] Distance of a mark from the guess, above which the guess is
    /// unreliable there: of 60 masks of five thin structures that lacked a quarter, with 5 to 30 marks, 15 had a mark
    /// that lay farther; 9 of these became worse, as did 3 of the others.
    double far_from_guess = heuristic("doubts.far_from_guess", 4.0);
    /// [fraction of the image's range] Size of a step of single precision, above which borders are lost.
    double lost_precision = heuristic("doubts.lost_precision", 0.01);
    /// [probability] That the image varies more at a mark than beside it, below which it does not show the marked
    /// border: 0.5 for an unrelated image; 0.39 to 1 with the right marks, on eight structures of five images.
    double image_support = heuristic("doubts.image_support", 0.4);
    /// [standard errors] Of that probability, added to the measured value before it is compared.
    double support_errors = heuristic("doubts.support_errors", 2.0);
    /// [marks] Maximum at which the image is evaluated, taken evenly: more add no information.
    std::size_t support_marks = heuristic("doubts.support_marks", 3000);
    /// [fraction of the slope] Of the image at the marks, relative to the steepest slope within ten voxels beside them:
    /// 0.73 to 1 for 27 nuclei, a brain, a spleen, a spinal cord and three tissues (0.31 for a nucleus with poor
    /// labels); below 0.5 for 15 of these 34 if the marks are of a body 0.6 times as large, for 25 if it is 1.5 times
    /// as large.
    double border_fraction = heuristic("doubts.border_fraction", 0.6);
    /// [standard errors] Minimum difference of the two slopes, averaged over the marks: in noise the largest of twenty
    /// stays below.
    double border_errors = heuristic("doubts.border_errors", 4.0);
    /// [Dice] Expected Dice below which a result is doubted: of 26 results with less than 0.8, 24 were below it, of 94
    /// with more than 0.9, two.
    double min_expected_dice = heuristic("doubts.min_expected_dice", 0.87);
    /// [nats] Gain of guidance: 0 to 0.06 with noise in place of the image, 0.08 to 1.2 with the right marks, on the
    /// same structures.
    double min_gain = heuristic("doubts.min_gain", 0.05);
    /// [probability] Support above which a low gain alone raises no doubt: at most 0.62 for shifted, mirrored or
    /// randomly placed marks with a low gain, 0.59 to 0.86 for the right marks on dim nuclei, whose gain is low, too.
    double clear_support = heuristic("doubts.clear_support", 0.65);
    /// [reaches] Deviation of twelve neighbouring points of a cloud from a quadric, below which they form a sheet: 0.33
    /// if they fill a ball, 0.26 and more if the noise is as large as the distance between nearest points, 0.11 to
    /// 0.247 in folds that were smoothed as noise.
    double sheet = heuristic("doubts.sheet", 0.25);
    /// [ratio] Of the estimated noise to that deviation, above which folds were mistaken for noise: up to 1.5 for noise
    /// of such thin sheets, 2.0 to 11 for folds, shells and misaligned scans.
    double folded_noise = heuristic("doubts.folded_noise", 1.75);
};
COVOL_HEURISTICS DoubtsHeuristics kDoubts{};

/// Clouds without an inside: solve/vanished.cpp.
struct VanishedHeuristics {
    /// [longest extents] Clouds thinner than this are flat.
    double thin_fraction = heuristic("vanished.thin_fraction", 0.02);
    /// [spacings] Thickness of a layer around points without an inside: it closes the gaps between random points.
    double layer_spacings = heuristic("vanished.layer_spacings", 4.5);
    /// [longest sides] Diameter of a ball that fits into no body within the points' box.
    double hull = heuristic("vanished.hull", 0.6);
    /// [voxels] Maximum thickness of that layer: less than what the pipeline closes again.
    double layer_voxels = heuristic("vanished.layer_voxels", 4.0);
    /// [D] Factor of the suggested larger tag distance; beyond the inner radius everything that the points surround is
    /// one body.
    double wider_tag = heuristic("vanished.wider_tag", 1.25);
};
COVOL_HEURISTICS VanishedHeuristics kVanished{};

/// What is reported of the surface: result/.
struct FinalSurfaceHeuristics {
    /// [fraction of the area] Without points, above which there is a warning.
    double warn_without_points = heuristic("final_surface.warn_without_points", 0.02);
    /// [distances between points and a hole] Slack at the rim: half a spacing if the distance is automatic.
    double rim_slack = heuristic("final_surface.rim_slack", 1.0 / 6);
    /// [marks] For each handle, if there are several, of a surface through marks; with fewer, the handles are doubted.
    double marks_of_handle = heuristic("final_surface.marks_of_handle", 100);
};
COVOL_HEURISTICS FinalSurfaceHeuristics kFinal{};

/// Starts of a run: segment/start.
struct StartsHeuristics {
    /// [voxels] By which a guess that the image cuts is continued beyond the image.
    int guess_beyond_voxels = heuristic("starts.guess_beyond_voxels", 8);
    /// [longest sides] Margin of the domain around points alone; a surface that extends farther is cut there.
    double guess_margin = heuristic("starts.guess_margin", 0.25);
    /// [voxels] By which a tagged body that the image cuts is continued beyond it, so that its band meets the face at a
    /// right angle.
    double tagged_beyond_voxels = heuristic("starts.tagged_beyond_voxels", 6.0);
    /// [voxels] Weight of curvature for a start that lies at the edges.
    double grown_delta_voxels = heuristic("starts.grown_delta_voxels", 0.1);
    /// [spacings] Range of the points around a cloud's own surface.
    double reach_spacings = heuristic("starts.reach_spacings", 3.0);
    /// [fraction of the given normals] That contradict the result, above which there is a warning.
    double warn_disagreeing = heuristic("starts.warn_disagreeing", 0.1);
    /// [longest sides] Margin beyond the points of a cloud: the surface bulges at holes.
    double margin_fraction = heuristic("starts.margin_fraction", 0.1);
    /// [slices] Radius of a correction, so that a mark on one slice affects the next.
    double radius_spacings = heuristic("starts.radius_spacings", 2.0);
    /// [voxels] If the tag distance is larger, the start is the closing of the tagged surface instead.
    double close_from_voxels = heuristic("starts.close_from_voxels", 5.0);
    /// [voxels] A mark on an end slice that lies deeper than this in the start is not part of the outline.
    double cap_depth_voxels = heuristic("starts.cap_depth_voxels", 2.5);
    /// [spacings] Of the points; points farther from a face than this do not indicate that the face cuts the body.
    double mirror_spacings = heuristic("starts.mirror_spacings", 4.0);
};
COVOL_HEURISTICS StartsHeuristics kStarts{};

}  // namespace covol
