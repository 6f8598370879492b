#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// Spacing and noise of a cloud from quadrics fitted to neighbourhoods of increasing size: cloud_scale.cpp.
struct CloudScaleHeuristics {
    /// [radii] Standard deviation from the quadric below which the neighbourhood is a sheet; it is 0.45 for points that
    /// fill a ball.
    double sheet = heuristic("cloud_scale.sheet", 0.15);
    /// [ratio] Increase of that deviation, in radii, at which the search for larger neighbourhoods ends.
    double worse = heuristic("cloud_scale.worse", 1.05);
};
COVOL_HEURISTICS CloudScaleHeuristics kCloudScale{};

/// Points that lie on no sheet: stray.cpp.
struct StrayHeuristics {
    /// [median distances to the last neighbour] Distance of the last neighbour from which on a point is isolated.
    double far = heuristic("stray.far", 2.5);
};
COVOL_HEURISTICS StrayHeuristics kStray{};

/// Points that fill a solid: filled.cpp.
struct FilledHeuristics {
    /// [radii] Minimum standard deviation along any direction, at all radii, for points that fill a solid: measured
    /// 0.29 to 0.42 for balls, boxes, tori and lattices, at most 0.24 for surfaces with noise and thin parts.
    double min_thickness = heuristic("filled.min_thickness", 0.27);
    /// [fraction of the expected one] The same for few points, for which it is smaller.
    double thick = heuristic("filled.thick", 0.8);
};
COVOL_HEURISTICS FilledHeuristics kFilled{};

/// Normals that agree with their indicator function: orientation.cpp. The iteration follows Hou et al., Iterative
/// Poisson surface reconstruction (iPSR), ACM Trans. Graph. 41(4), 2022; several attempts and the measure of doubt are
/// added here.
struct OrientationHeuristics {
    /// [cells] Of the density grid whose gradient gives the initial normals.
    double first_cells = heuristic("orientation.first_cells", 3.2);
    /// [indicator] Value above which another part encloses a point; noise causes it for points that are not enclosed.
    double enclosed = heuristic("orientation.enclosed", 0.9);
    /// [indicator] The same with a margin for more noise.
    double surely_enclosed = heuristic("orientation.surely_enclosed", 1.2);
    /// [spacings] Cell of the finest lattice: with smaller ones single points may turn, larger ones lose thin parts.
    double cell_spacings = heuristic("orientation.cell_spacings", 0.8);
    /// [cells] Maximum along the longest side in the first attempts, and of the cells that block a view: limits time
    /// and memory.
    double first_along = limit("orientation.first_along", 192);
    /// [points] Maximum number used in the iteration: limits the time.
    double max_sampled = limit("orientation.max_sampled", 100000);
    /// [spacings] Noise below which the points of a sheet lie beside one another, not above.
    double sharp = heuristic("orientation.sharp", 0.3);
    /// [ratio] Of the points missed by a doubtful orientation to those missed by the orientation from views, below
    /// which points enclose a solid nevertheless: 0.06 to 0.21 for closed shapes and shells open at one end, 0.83 to
    /// 0.97 for scans of one side, 0.44 for thin noisy shells.
    double fewer_passed = heuristic("orientation.fewer_passed", 1.0 / 3);
    /// [spacings] Distance from a point from which on the surface misses it.
    double passed_reach = heuristic("orientation.passed_reach", 1.5);
};
COVOL_HEURISTICS OrientationHeuristics kOrientation{};

/// Normals and sensors of the file, checked: given_sides.cpp.
struct GivenSidesHeuristics {
    /// [fraction] Minimum of the normals that the other half predicts, and of the points that their sensor sees; at
    /// least half of meaningless normals are predicted, and a body hides at least half of itself from a wrong position.
    double min_right = heuristic("given_sides.min_right", 0.65);
    /// [indicator's step over a cell] Slope from which on the indicator contradicts a normal.
    double speaks_against = heuristic("given_sides.speaks_against", 0.1);
};
COVOL_HEURISTICS GivenSidesHeuristics kGivenSides{};

/// Normals of local planes, with signs propagated from neighbour to neighbour: propagation.cpp.
struct PropagationHeuristics {
    /// [points] Maximum to which a plane is fitted: limits the time.
    double maximum = limit("propagation.maximum", 100);
};
COVOL_HEURISTICS PropagationHeuristics kPropagation{};

/// Scans of one side, oriented by the directions from which each point can be seen: views.cpp.
struct ViewsHeuristics {
    /// [rays] From each cell, evenly distributed over the sphere.
    int rays = heuristic("views.rays", 96);
    /// [weight] Of each point's own free directions, relative to the sky's.
    double beside_sky = heuristic("views.beside_sky", 0.1);
    /// [indicator's slope over a cell] Weight of the points in the screened indicator (Kazhdan and Hoppe, Screened
    /// Poisson surface reconstruction, ACM Trans. Graph. 32(3), 2013).
    double screening = heuristic("views.screening", 4);
};
COVOL_HEURISTICS ViewsHeuristics kViews{};

/// Layers of a scan below others: layers.cpp. Lengths are relative to the distance from which on points are not of one
/// sheet.
struct LayersHeuristics {
    /// [distances between sheets] Maximum depth of a layer below the one that hides it.
    double farthest_layer = heuristic("layers.farthest_layer", 6);
    /// [fraction of a patch's points] Maximum that may be far from the surface after turning.
    double max_away = heuristic("layers.max_away", 0.2);
    /// [areas of the patch] Maximum decrease of the bare surface: the far side of a cavity is not much larger than its
    /// near side, unlike the hole of a ring.
    double max_gain = heuristic("layers.max_gain", 1.5);
    /// [patches] Maximum number tried; each requires a solution.
    int max_patches = limit("layers.max_patches", 12);
};
COVOL_HEURISTICS LayersHeuristics kLayers{};

}  // namespace covol
