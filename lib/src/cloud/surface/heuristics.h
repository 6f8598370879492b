#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristics.h"

namespace covol {

/// Quadrics over neighbourhoods whose width adapts to the noise: local_fit.cpp. O. V. Lepski's rule as in Goldenshluger
/// and Nemirovski, On spatially adaptive estimation of nonparametric regression, Math. Methods Statist. 6(2), 1997.
struct LocalFitHeuristics {
    /// [count] Maximum number of radii.
    int levels = heuristic("local_fit.levels", 9);
    /// [spacings] The first radius: about 12 points.
    double first_spacings = heuristic("local_fit.first_spacings", 2.0);
    /// [radii] Edge of the cells whose points are averaged before the fit.
    double thinned_fraction = heuristic("local_fit.thinned_fraction", 0.2);
    /// [points] Minimum to which a quadric is fitted.
    std::size_t min_points = heuristic("local_fit.min_points", 9);
    /// [radii] Misfit above which the neighbourhood does not count as a sheet; it is 0.45 for points that fill a ball.
    double sheet_fraction = heuristic("local_fit.sheet_fraction", 0.3);
    /// [ratio] Ratio of the misfit to the points' distance from the indicator's surface, above which the neighbourhood
    /// contains more than one sheet. Smaller values mistake noise that the indicator follows for sheets; from 4 on some
    /// folds are missed.
    double off_indicator = heuristic("local_fit.off_indicator", 3);
    /// [standard deviations] Maximum difference between the heights of a wider fit and of each narrower one; values of
    /// 1 to 2 change the errors by a tenth.
    double agreement = heuristic("local_fit.agreement", 1.5);
    /// [ratio] Ratio of the misfit to that of a narrower fit, above which the wider fit is rejected.
    double misfit_growth = heuristic("local_fit.misfit_growth", 1.13);
    /// [fraction of the weights] Added to the diagonal of the equations for the curvatures, which would be singular for
    /// points on a line.
    double ridge = heuristic("local_fit.ridge", 1e-4);
    /// [radii] Distance from the tangent plane above which points may belong to another sheet.
    double sheet_height = heuristic("local_fit.sheet_height", 0.15);
    /// [radii] Maximum distance of a sheet's foot from its node.
    double max_height = heuristic("local_fit.max_height", 0.4);
    /// [cosine] Minimum between the node's normal and that of the fitted quadric.
    double min_cosine = heuristic("local_fit.min_cosine", 0.4);
    /// [radii] Minimum standard deviation of the points along any tangential direction; it is 0.35 if they fill the
    /// disc.
    double min_spread = heuristic("local_fit.min_spread", 0.16);
    /// [radii] Maximum distance of the points' mean from the centre: it is 0.29 for half a disc and larger beyond the
    /// end of a sheet.
    double max_off_centre = heuristic("local_fit.max_off_centre", 0.33);
    /// [ratio] Maximum growth of the radius until the points form a sheet.
    double max_growth = heuristic("local_fit.max_growth", 2.9);
    /// [points] Minimum number for the decision which of two opposite directions most normals have.
    double min_majority = heuristic("local_fit.min_majority", 5);
    /// [noises] Maximum correction of the height for the bias that results from noise along a curved surface.
    double max_unbent = heuristic("local_fit.max_unbent", 0.5);
    /// [ratio] Ratio of the edges of the cells from which the first and the last nodes are taken; a power of two.
    double widest = heuristic("local_fit.widest", 8);
    /// [distances between nodes] Minimum radius of quadrics at all but the finest nodes: only wide quadrics may have
    /// few nodes.
    double wide_of_apart = heuristic("local_fit.wide_of_apart", 7);
    /// [cosine] Minimum between the normals of a node and of a quadric on the same sheet.
    double same_sheet = heuristic("local_fit.same_sheet", 0.7);
    /// [ratio] A quadric is dropped if the smallest neighbourhood that determines it has a radius of more than this
    /// many times that of a nearby quadric, and of the median quadric. Values of 2 to 4 give the same surfaces.
    double lone = heuristic("local_fit.lone", 2.5);
};
COVOL_HEURISTICS LocalFitHeuristics kFit{};

/// Sheets that meet in edges or corners: crease.cpp, local_fit.cpp.
struct CreaseHeuristics {
    /// [spacings] Radius of the neighbourhoods in which creases are sought: about 50 points.
    double radius = heuristic("crease.radius", 4.0);
    /// [ratio] Maximum ratio of the misfit of several sheets to that of fewer sheets or one quadric.
    double misfit_ratio = heuristic("crease.misfit_ratio", 0.5);
    /// [radii] Misfit of the sheets above which there is no crease, because noise was divided.
    double max_misfit = heuristic("crease.max_misfit", 0.05);
    /// [distances between nodes] Minimum radius for creases, in the sense of local_fit.wide_of_apart.
    double wide_of_apart = heuristic("crease.wide_of_apart", 3);
    /// [cosine] Cosine between the normals of two sheets above which they do not form a crease.
    double smooth_cosine = heuristic("crease.smooth_cosine", 0.9);
};
COVOL_HEURISTICS CreaseHeuristics kCrease{};

/// The blend of the quadrics with the indicator, as a level set: cloud_field.cpp, cloud_surface.cpp.
struct CloudSurfaceHeuristics {
    /// [voxels] Desired minimum reach of a quadric.
    double reach_voxels = heuristic("blend.reach_voxels", 2.5);
    /// [minimum radii] The same, relative to the smallest neighbourhood that determines the quadric.
    double reach_of_min = heuristic("blend.reach_of_min", 1.25);
    /// [radii] The same, relative to the neighbourhood of the fit.
    double reach_of_radius = heuristic("blend.reach_of_radius", 0.35);
    /// [radii] Maximum reach, because the quadric was not fitted to points beyond the radius.
    double max_of_radius = heuristic("blend.max_of_radius", 0.8);
    /// [radii of curvature] Maximum reach: distances from a quadric are ambiguous beyond its radius of curvature.
    double max_of_curvature = heuristic("blend.max_of_curvature", 0.7);
    /// [voxels] Minimum reach in any case.
    double min_reach_voxels = heuristic("blend.min_reach_voxels", 1.5);
    /// [minimum radii] Lateral distance from a quadric's foot beyond which other quadrics apply if the surface
    /// continues.
    double beside_of_min = heuristic("blend.beside_of_min", 0.75);
    /// [half widths of the band] Distance from the nearest quadric above which only that one is evaluated.
    double far_bands = heuristic("blend.far_bands", 1.5);
    /// [reaches] Distance from the foot from which on the indicator gradually replaces the quadric.
    double trusted = heuristic("blend.trusted", 0.6);
    /// [indicator per cell] Slope of the indicator at the surface, by which its deviation from 1/2 is converted to a
    /// distance.
    double slope = heuristic("blend.slope", 0.4);
    /// [indicator] Deviation from 1/2 from which on the distance may be larger than the converted one; at twice this
    /// deviation, it is the half width of the band.
    double sure = heuristic("blend.sure", 0.2);
    /// [voxels] Edge of the finest cells, each of which has a node with a quadric.
    double node_voxels = heuristic("blend.node_voxels", 0.75);
    /// [noises] Distance from the indicator's level 1/2 up to which points are moved to it before nodes are chosen.
    double max_noises = heuristic("blend.max_noises", 3);
    /// [steps] Number of steps of Newton's method for that move.
    int level_steps = heuristic("blend.level_steps", 2);
    /// [fraction of the points] Minimum on a separate piece, and at least common.quadric points: noise creates spurious
    /// pieces.
    double min_resting_fraction = heuristic("blend.min_resting_fraction", 1e-3);
    /// [spacings] Cell size of the indicator that determines the topology for points with gaps.
    double coarse_spacings = heuristic("blend.coarse_spacings", 2.4);
    /// [spacings] Distance from all points from which on the surface is bare.
    double far_spacings = heuristic("blend.far_spacings", 3);
    /// [fraction of the area] Fraction of bare surface above which the points have gaps.
    double open_fraction = heuristic("blend.open_fraction", 0.05);
    /// [fraction of the points] Minimum on a separate piece if the points enclose nothing: separate pieces are then not
    /// thin parts of a solid.
    double min_resting_open = heuristic("blend.min_resting_open", 1e-2);
};
COVOL_HEURISTICS CloudSurfaceHeuristics kBlend{};

/// Connection of small pieces that were torn off: join_pieces.cpp.
struct JoinPiecesHeuristics {
    /// [distances between points] Maximum length of a gap that is closed.
    double max_gap = heuristic("join_pieces.max_gap", 4);
};
COVOL_HEURISTICS JoinPiecesHeuristics kJoin{};

}  // namespace covol
