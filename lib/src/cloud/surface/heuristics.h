#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristics.h"

namespace covol {

/// Quadrics over neighbourhoods whose width adapts to the noise: local_fit.cpp. O. V. Lepski's rule as in Goldenshluger
/// and Nemirovski, On spatially adaptive estimation of nonparametric regression, Math. Methods Statist. 6(2), 1997.
struct LocalFitHeuristics {
    /// [count] Maximum number of radii of the neighbourhoods to which quadrics are fitted: limits the time.
    int levels = limit("local_fit.levels", 9);
    /// [spacings] Radius of the smallest neighbourhoods, which contain about 12 points.
    double first_spacings = heuristic("local_fit.first_spacings", 2.0);
    /// [radii] Edge of the cells whose points are averaged before the fit.
    double thinned_fraction = heuristic("local_fit.thinned_fraction", 0.2);
    /// [points] Minimum number of thinned points to which a quadric is fitted.
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
    /// [radii] Minimum standard deviation of the points along any tangential direction; it is 0.35 if they fill the
    /// disc.
    double min_spread = heuristic("local_fit.min_spread", 0.16);
    /// [radii] Maximum distance of a quadric from the node at which it is fitted; farther away, there is no quadric.
    double max_height = heuristic("local_fit.max_height", 0.4);
    /// [radii] Maximum distance of the points' mean from the centre: it is 0.29 for half a disc and larger beyond the
    /// end of a sheet.
    double max_off_centre = heuristic("local_fit.max_off_centre", 0.33);
    /// [ratio] Maximum ratio of the smallest radius at which a quadric fits to that at which there are enough points;
    /// if no quadric fits up to this ratio, the node has none.
    double max_growth = heuristic("local_fit.max_growth", 2.9);
    /// [points] Minimum number of points on a node's sheet for the decision whether most of their normals are on the
    /// side of the node's normal.
    double min_majority = heuristic("local_fit.min_majority", 5);
    /// [ratio] Ratio of the edge of the cells from which the first, widest nodes are taken to that for the last, finest
    /// ones; a power of two, because the edge is halved until it is the finest.
    double widest = heuristic("local_fit.widest", 8);
    /// [distances between nodes] Minimum radius of quadrics and creases at all but the finest nodes: narrower ones are
    /// dropped, and finer nodes are taken there.
    double wide_of_apart = heuristic("local_fit.wide_of_apart", 7);
};
COVOL_HEURISTICS LocalFitHeuristics kFit{};

/// Sheets that meet in edges or corners: crease.cpp, local_fit.cpp.
struct CreaseHeuristics {
    /// [spacings] Radius of the neighbourhoods in which creases are sought: about 50 points.
    double radius = heuristic("crease.radius", 4.0);
    /// [radii] Misfit of the sheets above which there is no crease: the division into sheets then depends on noise.
    double max_misfit = heuristic("crease.max_misfit", 0.05);
};
COVOL_HEURISTICS CreaseHeuristics kCrease{};

/// The blend of the quadrics with the indicator, as a level set: cloud_field.cpp, cloud_surface.cpp.
struct CloudSurfaceHeuristics {
    /// [voxels] Desired minimum reach of a quadric, the distance from its foot up to which it applies.
    double reach_voxels = heuristic("blend.reach_voxels", 2.5);
    /// [minimum radii] Desired minimum reach of a quadric, relative to the radius of the smallest neighbourhood with
    /// enough points.
    double reach_of_min = heuristic("blend.reach_of_min", 1.25);
    /// [radii] Desired minimum reach of a quadric, relative to the radius of the neighbourhood of its fit.
    double reach_of_radius = heuristic("blend.reach_of_radius", 0.35);
    /// [reaches] Distance from the foot from which on the indicator gradually replaces the quadric.
    double trusted = heuristic("blend.trusted", 0.6);
    /// [indicator per cell] Slope of the indicator at the surface, by which its deviation from 1/2 is converted to a
    /// distance.
    double slope = heuristic("blend.slope", 0.4);
    /// [indicator] Deviation from 1/2 above which the distance is no longer only converted by blend.slope: it has a
    /// minimum, which increases from 0 to the half width of the band at twice this deviation.
    double sure = heuristic("blend.sure", 0.2);
    /// [voxels] Edge of the finest cells, each of which has a node with a quadric.
    double node_voxels = heuristic("blend.node_voxels", 0.75);
};
COVOL_HEURISTICS CloudSurfaceHeuristics kBlend{};

/// Connection of small pieces that were torn off: join_pieces.cpp.
struct JoinPiecesHeuristics {
    /// [distances between points] Maximum length of a gap between a small piece and another one, for it to be closed.
    double max_gap = heuristic("join_pieces.max_gap", 4);
};
COVOL_HEURISTICS JoinPiecesHeuristics kJoin{};

}  // namespace covol
