#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include <cstddef>

#include "base/heuristic.h"

namespace covol {

/// Quadrics as wide as the noise asks for: local_fit.cpp. O. V. Lepski's rule as in Goldenshluger and Nemirovski, On
/// spatially adaptive estimation of nonparametric regression, Math. Methods Statist. 6(2), 1997.
struct LocalFitHeuristics {
    /// [count] Most radii.
    int levels = heuristic("local_fit.levels", 9);
    /// [ratio] Of a radius to the one before.
    double growth = heuristic("local_fit.growth", 1.4142135623730951);
    /// [spacings] The first radius: about 12 points.
    double first_spacings = heuristic("local_fit.first_spacings", 2.0);
    /// [radii] Points closer than that are averaged first.
    double thinned_fraction = heuristic("local_fit.thinned_fraction", 0.2);
    /// [points] Fewest that a quadric is fitted to.
    std::size_t min_points = heuristic("local_fit.min_points", 9);
    /// [radii] Misfit above which the neighbourhood is no sheet; points that fill a ball have 0.45.
    double sheet_fraction = heuristic("local_fit.sheet_fraction", 0.3);
    /// [ratio] Of the misfit to the points' distance to the indicator's surface, above which the neighbourhood is more
    /// than one sheet. Less, and it is noise that the indicator follows; from 4 on some folds are passed by.
    double off_indicator = heuristic("local_fit.off_indicator", 3);
    /// [standard deviations] That wider fits may differ from narrower ones; 1 to 2 change the errors by a tenth.
    double agreement = heuristic("local_fit.agreement", 1.5);
    /// [ratio] Of the misfit, beyond which the wider fit itself is off.
    double misfit_growth = heuristic("local_fit.misfit_growth", 1.13);
    /// [share of the weights] Added to the curvatures' equations: points on a line.
    double ridge = heuristic("local_fit.ridge", 1e-4);
    /// [radii] What is farther off the plane may be another sheet.
    double sheet_height = heuristic("local_fit.sheet_height", 0.15);
    /// [radii] A foot farther from its node is no sheet's.
    double max_height = heuristic("local_fit.max_height", 0.4);
    /// [cosine] Between the normal as it was oriented and as it is fitted.
    double min_cosine = heuristic("local_fit.min_cosine", 0.4);
    /// [radii] Standard deviation of the points along any direction; where they fill the disc 0.35.
    double min_spread = heuristic("local_fit.min_spread", 0.16);
    /// [radii] Of the points' mean: half a disc has 0.29, what lies beyond a sheet's end more.
    double max_off_centre = heuristic("local_fit.max_off_centre", 0.33);
    /// [ratio] Of the radius, until the points are a sheet.
    double max_growth = heuristic("local_fit.max_growth", 2.9);
    /// [points] That tell on which side the normals are.
    double min_majority = heuristic("local_fit.min_majority", 5);
    /// [noises] That the noise is taken to have lowered the points along a bent surface.
    double max_unbent = heuristic("local_fit.max_unbent", 0.5);
    /// [ratio] Of the first nodes' cells to the last ones', a power of two.
    double widest = heuristic("local_fit.widest", 8);
    /// [distances between nodes] Least radius of all but the last: there need not be more.
    double wide_of_apart = heuristic("local_fit.wide_of_apart", 7);
    /// [cosine] Between normals of quadrics of one sheet.
    double same_sheet = heuristic("local_fit.same_sheet", 0.7);
    /// [least radii] Of a quadric beside those of points that lie closer, which is dropped; 2 to 4 give the same
    /// surfaces.
    double lone = heuristic("local_fit.lone", 2.5);
};
COVOL_HEURISTICS LocalFitHeuristics kFit{};

/// Sheets that meet: crease.cpp, local_fit.cpp.
struct CreaseHeuristics {
    /// [spacings] Radius of the neighbourhoods in which creases are looked for: about 50 points.
    double radius = heuristic("crease.radius", 4.0);
    /// [ratio] Of the misfit of the sheets to that of one quadric.
    double misfit_ratio = heuristic("crease.misfit_ratio", 0.5);
    /// [radii] Misfit above which it is noise that is divided.
    double max_misfit = heuristic("crease.max_misfit", 0.05);
    /// [distances between nodes] Least radius, as local_fit.wide_of_apart.
    double wide_of_apart = heuristic("crease.wide_of_apart", 3);
    /// [cosine] Between normals of sheets that meet smoothly.
    double smooth_cosine = heuristic("crease.smooth_cosine", 0.9);
    /// [cosine] Between normals of a sheet and the other side of a thin body.
    double other_side = heuristic("crease.other_side", -0.5);
};
COVOL_HEURISTICS CreaseHeuristics kCrease{};

/// The blend of the quadrics with the indicator, as a level set: cloud_surface.cpp.
struct CloudSurfaceHeuristics {
    /// [voxels] Reach of a quadric, at least.
    double reach_voxels = heuristic("blend.reach_voxels", 2.5);
    /// [least radii] The same: the smallest neighbourhood that tells of it.
    double reach_of_min = heuristic("blend.reach_of_min", 1.25);
    /// [radii] The same: the one it was fitted to.
    double reach_of_radius = heuristic("blend.reach_of_radius", 0.35);
    /// [radii] Beyond it the quadric was never fitted.
    double max_of_radius = heuristic("blend.max_of_radius", 0.8);
    /// [radii of curvature] Beyond it a quadric folds over.
    double max_of_curvature = heuristic("blend.max_of_curvature", 0.7);
    /// [voxels] The reach whatever else holds.
    double min_reach_voxels = heuristic("blend.min_reach_voxels", 1.5);
    /// [least radii] Beyond it, sideways, there should be other quadrics.
    double beside_of_min = heuristic("blend.beside_of_min", 0.75);
    /// [distances between nodes] The same.
    double beside_of_apart = heuristic("blend.beside_of_apart", 2);
    /// [half widths of the band] From the nearest quadric: beyond, the others are not asked.
    double far_bands = heuristic("blend.far_bands", 1.5);
    /// [reaches] Beyond, the indicator takes over.
    double trusted = heuristic("blend.trusted", 0.6);
    /// [indicator per cell] At the surface; it makes a distance of the indicator.
    double slope = heuristic("blend.slope", 0.4);
    /// [indicator] Distance from 1/2 from which on the surface is taken to be farther away than a cell tells; from
    /// twice that on no surface is near.
    double sure = heuristic("blend.sure", 0.2);
    /// [voxels] Distance of quadrics.
    double node_voxels = heuristic("blend.node_voxels", 0.75);
    /// [noises] That their nodes may be moved to the level.
    double max_noises = heuristic("blend.max_noises", 3);
    /// [steps] Of Newton's method, of that move.
    int level_steps = heuristic("blend.level_steps", 2);
    /// [points] On a piece of its own; noise makes pieces of nothing.
    double min_resting = heuristic("blend.min_resting", 12);
    /// [share of the points] The same.
    double min_resting_fraction = heuristic("blend.min_resting_fraction", 1e-3);
    /// [spacings] Cells of an indicator for points with gaps.
    double coarse_spacings = heuristic("blend.coarse_spacings", 2.4);
    /// [spacings] Distance to all points from which on the surface is bare.
    double far_spacings = heuristic("blend.far_spacings", 3);
    /// [share of the area] That is bare, above which points have gaps.
    double open_fraction = heuristic("blend.open_fraction", 0.05);
    /// [share of the points] On a piece of its own where they enclose nothing: the pieces are none of thin parts.
    double min_resting_open = heuristic("blend.min_resting_open", 1e-2);
};
COVOL_HEURISTICS CloudSurfaceHeuristics kBlend{};

/// The indicator's topology, held by simple points: hold_topology.cpp.
struct HoldTopologyHeuristics {
    /// [voxels] From the surface, of a voxel that keeps its sign.
    double held_voxels = heuristic("hold_topology.held_voxels", 0.1);
};
COVOL_HEURISTICS HoldTopologyHeuristics kHold{};

/// Small torn pieces: join_pieces.cpp.
struct JoinPiecesHeuristics {
    /// [volumes of the largest piece] Of a piece that may be torn off.
    double small = heuristic("join_pieces.small", 0.1);
    /// [distances between points] Of a gap that is closed.
    double max_gap = heuristic("join_pieces.max_gap", 4);
    /// [distances between points] A place of the gap without a point as near is one where the surface ends.
    double near = heuristic("join_pieces.near", 1.0);
    /// [distances between points] Reach of those that tell how thick the part is.
    double around = heuristic("join_pieces.around", 1);
    /// [distances between points] What is thicker does not tear.
    double thickest = heuristic("join_pieces.thickest", 0.5);
};
COVOL_HEURISTICS JoinPiecesHeuristics kJoin{};

}  // namespace covol
