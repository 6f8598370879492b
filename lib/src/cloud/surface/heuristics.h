#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
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
    /// [radii] Maximum misfit of a sheet, distance of its points from a plane through one of them, of its foot from the
    /// node, and of the points' mean from the node: the misfit is 0.45 for points that fill a ball, and the mean 0.29
    /// off for half a disc.
    double sheet = heuristic("local_fit.sheet", 0.33);
    /// [ratio] Of the misfit to the points' distance from the indicator's surface, above which the neighbourhood
    /// contains more than one sheet. Smaller values mistake noise that the indicator follows for sheets; from 4 on some
    /// folds are missed.
    double off_indicator = heuristic("local_fit.off_indicator", 3);
    /// [standard deviations] Maximum difference between wider and narrower fits; values of 1 to 2 change the errors by
    /// a tenth.
    double agreement = heuristic("local_fit.agreement", 1.5);
    /// [ratio] Of the misfit to that of narrower fits, above which the wider fit is rejected.
    double misfit_growth = heuristic("local_fit.misfit_growth", 1.13);
    /// [fraction of the weights] Added to the equations of the curvatures, for points on a line.
    double ridge = heuristic("local_fit.ridge", 1e-4);
    /// [noises] Maximum correction of the height by which noise displaces points along a curved surface.
    double max_unbent = heuristic("local_fit.max_unbent", 0.5);
    /// [distances between nodes] Minimum radius, also of creases, for all but the finest nodes: wide
    /// quadrics need few nodes.
    double wide_of_apart = heuristic("local_fit.wide_of_apart", 7);
    /// [minimum radii] Maximum radius until the points form a sheet, and ratio to the minimum radius of nearby quadrics
    /// from more closely spaced points, above which a quadric is dropped.
    double wider = heuristic("local_fit.wider", 2.5);
};
COVOL_HEURISTICS LocalFitHeuristics kFit{};

/// Sheets that meet: crease.cpp, local_fit.cpp.
struct CreaseHeuristics {
    /// [ratio] Maximum of the misfit of the sheets to that of one quadric.
    double misfit_ratio = heuristic("crease.misfit_ratio", 0.5);
    /// [radii] Misfit above which only noise is divided.
    double max_misfit = heuristic("crease.max_misfit", 0.05);
    /// [cosine] Between normals above which sheets meet smoothly.
    double smooth_cosine = heuristic("crease.smooth_cosine", 0.9);
};
COVOL_HEURISTICS CreaseHeuristics kCrease{};

/// The blend of the quadrics with the indicator, as a level set: cloud_surface.cpp.
struct CloudSurfaceHeuristics {
    /// [radii] Desired minimum reach of a quadric.
    double reach_of_radius = heuristic("blend.reach_of_radius", 0.35);
    /// [radii, radii of curvature] Maximum reach; also the lateral distance, in minimum radii, beyond which there
    /// should be other quadrics.
    double valid = heuristic("blend.valid", 0.75);
    /// [reaches] Distance from which on the indicator gradually replaces the quadric.
    double trusted = heuristic("blend.trusted", 0.6);
    /// [indicator] Deviation from 1/2 from which on the surface is assumed to be farther away than the conversion
    /// gives; from twice that on it is out of the band.
    double sure = heuristic("blend.sure", 0.2);
};
COVOL_HEURISTICS CloudSurfaceHeuristics kBlend{};

/// Reconnection of small torn pieces: join_pieces.cpp.
struct JoinPiecesHeuristics {
    /// [distances between points] Maximum length of a gap that is closed.
    double max_gap = heuristic("join_pieces.max_gap", 4);
};
COVOL_HEURISTICS JoinPiecesHeuristics kJoin{};

}  // namespace covol
