#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include <cstddef>

#include "base/heuristic.h"

namespace covol {

/// Values left to us: choices.cpp.
struct AutomaticHeuristics {
    /// [marks] Of a guess, or of a start that they correct: more take long, and are dense.
    std::size_t max_guess_marks = heuristic("automatic.max_guess_marks", 4000);
    /// [voxels] Range of the points after tagging with an image: what is farther from marks is the image's. Measured on
    /// brain, spleen and nucleus with 300 points each.
    double tag_attraction_voxels = heuristic("automatic.tag_attraction_voxels", 8.0);
    /// [points] Fewer that are tagged get a voxel size at which their surface has as many voxels as this many would.
    double few_points = heuristic("automatic.few_points", 1000);
    /// [voxels] Most on the sides of the box around few points: time. Of a ball's there are 35,000, of thin parts ten
    /// times as many; of points on curves more would be, the closer they lie.
    double max_box_voxels = heuristic("automatic.max_box_voxels", 3e5);
    /// [cells of the indicator] Voxel size of a cloud that encloses nothing, or fills a solid.
    double view_voxel = heuristic("automatic.view_voxel", 0.5);
    /// [voxels] Of the surface for each point, at most: of clouds on closed surfaces 4 to 8.
    double max_facets = heuristic("automatic.max_facets", 20);
    /// [noises] Voxel size of a cloud, at least.
    double cloud_noise = heuristic("automatic.cloud_noise", 0.6);
    /// [voxels] Seeds closer than this are one position.
    double same_seed_voxels = heuristic("automatic.same_seed_voxels", 1e-3);
    /// [voxels] Points closer than this do not move the surface apart.
    double merge_voxels = heuristic("automatic.merge_voxels", 0.25);
    /// [voxels] Range of the points after starts other than tagging.
    double attraction_voxels = heuristic("automatic.attraction_voxels", 5.0);
    /// [voxels] Weight of curvature after tagging with an image.
    double tag_delta_voxels = heuristic("automatic.tag_delta_voxels", 0.5);
    /// [voxels] Presmoothing of the image after tagging.
    double tag_sigma_voxels = heuristic("automatic.tag_sigma_voxels", 2.0);
    /// [times the distance of 99 % of the points from their middle] A point farther off is a mistake, where no lattice
    /// holds it.
    double wild_point = heuristic("automatic.wild_point", 1000);
    /// [voxels] Layers of a scan within it are averaged.
    double scan_radius_voxels = heuristic("automatic.scan_radius_voxels", 2.5);
    /// [voxels] A layer of points thicker than this is averaged.
    double noisy_fraction = heuristic("automatic.noisy_fraction", 0.3);
};
COVOL_HEURISTICS AutomaticHeuristics kAutomatic{};

/// Distance and edge detector of a run: solve/fields.cpp.
struct FieldsHeuristics {
    /// [voxels] Voxel of the coarse distance field that tells how far a tube has to reach.
    double coarse_factor = heuristic("fields.coarse_factor", 8.0);
    /// [sigmas] Beside a mark, to tell lines from borders.
    double sides_sigmas = heuristic("fields.sides_sigmas", 3.0);
    /// [of the way to a side] How deep inside it has to be.
    double side_depth = heuristic("fields.side_depth", 0.7);
    /// [marks] This many are looked at.
    std::size_t feature_marks = heuristic("fields.feature_marks", 4000);
};
COVOL_HEURISTICS FieldsHeuristics kFields{};

/// The domain: problem.h and start/.
struct JobHeuristics {
    /// [voxels] Between D and the domain's boundary, for points alone.
    double margin_voxels = heuristic("job.margin_voxels", 6.0);
};
COVOL_HEURISTICS JobHeuristics kJob{};

/// The flow of a run: solve/.
struct FlowHeuristics {
    /// [tau] Time step of the points' own approach.
    double approach_tau = heuristic("flow.approach_tau", 3.0);
    /// [steps] Of it, at most.
    int approach_steps = heuristic("flow.approach_steps", 40);
    /// [voxels a step] At which it ends.
    double approach_tolerance = heuristic("flow.approach_tolerance", 0.01);
    /// [voxels] That the surface may sink below the start where the points enclose nothing.
    double hold_depth = heuristic("flow.hold_depth", 0.75);
    /// [volumes of the grown start] A flow that leaves less has lost the edges.
    double min_of_grown = heuristic("flow.min_of_grown", 0.5);
    /// [voxels] Farther from its marks than the start: what flowed has left them.
    double leaves_voxels = heuristic("flow.leaves_voxels", 0.25);
    /// [distances between marked slices] How far the image may move the body between contours in one pass.
    double contour_range = heuristic("flow.contour_range", 0.25);
    /// [passes] Of asking the image between contours, each from the result of the one before.
    int contour_passes = heuristic("flow.contour_passes", 3);
    /// [voxels] The same of a body that marks and image have shown together: it lies close to where it ends.
    double inferred_range = heuristic("flow.inferred_range", 1.5);
};
COVOL_HEURISTICS FlowHeuristics kFlow{};

/// The coarse level: solve/coarse_level.cpp.
struct CoarseLevelHeuristics {
    /// [ratio] Of its voxel size.
    double refinement = heuristic("coarse_level.refinement", 2.0);
    /// [voxels of the coarse level] Presmoothing of the image, at least.
    double min_coarse_sigma = heuristic("coarse_level.min_coarse_sigma", 0.5);
    /// [voxels of the coarse level] Range of the points, at least.
    double min_coarse_attraction = heuristic("coarse_level.min_coarse_attraction", 3.0);
    /// [voxels a step] A surface far from all that pulls moves slowly, too.
    double coarse_tolerance = heuristic("coarse_level.coarse_tolerance", 5e-3);
    /// [voxels of the coarse level] Time step, where it is automatic: the result is but a start.
    double coarse_tau = heuristic("coarse_level.coarse_tau", 2.0);
    /// [voxels of the coarse level] That the fine level starts outside of the result.
    double step_back = heuristic("coarse_level.step_back", 2.0);
    /// [voxels] A smaller domain has little to gain, and thin things to lose.
    int min_coarsened = heuristic("coarse_level.min_coarsened", 64);
};
COVOL_HEURISTICS CoarseLevelHeuristics kCoarse{};

/// Warnings about marks: doubts.cpp and result/report.cpp.
struct DoubtsHeuristics {
    /// [longest edges of the image's voxel] No hand is so far off.
    double off_voxels = heuristic("doubts.off_voxels", 2.0);
    /// [voxels] Mean distance of marks on one side.
    double bias_voxels = heuristic("doubts.bias_voxels", 0.25);
    /// [standard errors of the mean] The same.
    double bias_errors = heuristic("doubts.bias_errors", 4.0);
    /// [noises of a cloud] That far off there is something else.
    double off_noise = heuristic("doubts.off_noise", 4.0);
    /// [diagonals of the marks' box] From every mark: there the surface is not the marks' any more.
    double far_diagonals = heuristic("doubts.far_diagonals", 0.5);
    /// [share of the surface] That far off.
    double far_fraction = heuristic("doubts.far_fraction", 0.05);
    /// [share of the marks] That a surface may miss.
    double missed_fraction = heuristic("doubts.missed_fraction", 0.1);
    /// [radii of the largest ball inside a guess] Between a mark and the guess, above which the guess says little about
    /// the body there: of 60 masks of five thin structures that lacked a quarter, with 5 to 30 marks, 15 had one that
    /// lay farther, 9 of which became worse, as did 3 of the others.
    double far_from_guess = heuristic("doubts.far_from_guess", 4.0);
    /// [share of the image's range] Of a step of single precision, above which borders are lost.
    double lost_precision = heuristic("doubts.lost_precision", 0.01);
    /// [probability] That the image varies more at a mark than beside it, below which it shows a border there instead:
    /// 0.5 for an image of something else; 0.39 to 1 with marks of its own, on eight structures of five images.
    double image_support = heuristic("doubts.image_support", 0.4);
    /// [standard errors] Of that, above what was found, which must stay below.
    double support_errors = heuristic("doubts.support_errors", 2.0);
    /// [marks] At which the image is looked at, evenly taken: more tell nothing new.
    std::size_t support_marks = heuristic("doubts.support_marks", 3000);
    /// [share of the slope] That the image has where the marks lie, of where it is steepest within ten voxels beside
    /// them: 0.73 to 1 for 27 nuclei, a brain, a spleen, a spinal cord and three tissues (0.31 for a nucleus with poor
    /// labels); below 0.5 for 15 of these 34 where the marks are of a body 0.6 times as large, for 25 where it is 1.5
    /// times.
    double border_fraction = heuristic("doubts.border_fraction", 0.6);
    /// [standard errors] Between both, on the mean of the marks: the largest of twenty stays below in noise.
    double border_errors = heuristic("doubts.border_errors", 4.0);
    /// [Dice] Expected of a result, below which it is doubted: of 26 results below 0.8 24 are, of 94 above 0.9 two.
    double min_expected_dice = heuristic("doubts.min_expected_dice", 0.87);
    /// [nats] Of guidance: 0 to 0.06 with noise in place of the image, 0.08 to 1.2 with marks of its own, on the same.
    double min_gain = heuristic("doubts.min_gain", 0.05);
    /// [probability] The support above which a low gain alone says nothing: at most 0.62 where marks that were shifted,
    /// mirrored or put anywhere have one, 0.59 to 0.86 for marks of their own on dim nuclei, which have one, too.
    double clear_support = heuristic("doubts.clear_support", 0.65);
    /// [reaches] Deviation of twelve neighbouring points of a cloud from a quadric, below which they are a sheet: 0.33
    /// where they fill a ball, 0.26 and more where noise is as wide as the nearest points lie apart, 0.11 to 0.247
    /// in folds that were smoothed as noise.
    double sheet = heuristic("doubts.sheet", 0.25);
    /// [ratio] Of the noise that was found to that deviation, above which folds were taken for it: up to 1.5 for noise
    /// of so thin sheets, 2.0 to 11 for folds, shells and scans that do not fit.
    double folded_noise = heuristic("doubts.folded_noise", 1.75);
};
COVOL_HEURISTICS DoubtsHeuristics kDoubts{};

/// Clouds without an inside: solve/vanished.cpp.
struct VanishedHeuristics {
    /// [longest extents] Thinner clouds are flat.
    double thin_fraction = heuristic("vanished.thin_fraction", 0.02);
    /// [spacings] Of a layer around points without an inside: closes the gaps of random points.
    double layer_spacings = heuristic("vanished.layer_spacings", 4.5);
    /// [longest sides] Such a ball fits into no body within it.
    double hull = heuristic("vanished.hull", 0.6);
    /// [voxels] Of that layer, at most: less than what the pipeline closes again.
    double layer_voxels = heuristic("vanished.layer_voxels", 4.0);
    /// [D] Beyond the inner radius all that the points surround is one body.
    double wider_tag = heuristic("vanished.wider_tag", 1.25);
};
COVOL_HEURISTICS VanishedHeuristics kVanished{};

/// What is told of the surface: result/.
struct FinalSurfaceHeuristics {
    /// [share of the area] Without points, above which there is a warning.
    double warn_without_points = heuristic("final_surface.warn_without_points", 0.02);
    /// [distances between points and a hole] Half a spacing, where it is automatic.
    double rim_slack = heuristic("final_surface.rim_slack", 1.0 / 6);
    /// [marks] For each handle, where there are several, of a surface through them, below which they are doubted.
    double marks_of_handle = heuristic("final_surface.marks_of_handle", 100);
};
COVOL_HEURISTICS FinalSurfaceHeuristics kFinal{};

/// Starts of a run: segment/start.
struct StartsHeuristics {
    /// [voxels] That a cut guess goes on beyond the image.
    int guess_beyond_voxels = heuristic("starts.guess_beyond_voxels", 8);
    /// [longest sides] Of the domain around points alone: a surface that goes on beyond is cut there.
    double guess_margin = heuristic("starts.guess_margin", 0.25);
    /// [voxels] That a cut tagged body goes on beyond the image, for a band at a right angle to the face.
    double tagged_beyond_voxels = heuristic("starts.tagged_beyond_voxels", 6.0);
    /// [voxels] Weight of curvature from a start that lies at the edges.
    double grown_delta_voxels = heuristic("starts.grown_delta_voxels", 0.1);
    /// [spacings] Range of the points around a cloud's own surface.
    double reach_spacings = heuristic("starts.reach_spacings", 3.0);
    /// [share of the given normals] Against the result, above which there is a warning.
    double warn_disagreeing = heuristic("starts.warn_disagreeing", 0.1);
    /// [longest sides] Beyond the points of a cloud: where they leave holes the surface bulges.
    double margin_fraction = heuristic("starts.margin_fraction", 0.1);
    /// [slices] Radius of a correction: a mark on a slice tells of the next one.
    double radius_spacings = heuristic("starts.radius_spacings", 2.0);
    /// [voxels] A tag distance beyond this starts from the closing instead.
    double close_from_voxels = heuristic("starts.close_from_voxels", 5.0);
    /// [voxels] A mark on an end slice that lies deeper in the start is none of the outline.
    double cap_depth_voxels = heuristic("starts.cap_depth_voxels", 2.5);
    /// [spacings] Of the points, beyond which none of them tells of a cut.
    double mirror_spacings = heuristic("starts.mirror_spacings", 4.0);
};
COVOL_HEURISTICS StartsHeuristics kStarts{};

}  // namespace covol
