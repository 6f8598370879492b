#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristics.h"

namespace covol {

/// Spacing and noise of a cloud from quadrics fitted to neighbourhoods of increasing size: cloud_scale.cpp.
struct CloudScaleHeuristics {
    /// [count] Maximum number of radii of the neighbourhoods that are tried.
    int radii = limit("cloud_scale.radii", 14);
    /// [median distances to the nearest point] The smallest radius of the neighbourhoods that are tried.
    double first_spacings = heuristic("cloud_scale.first_spacings", 3.0);
    /// [radii] Standard deviation from the quadric below which the neighbourhood is a sheet; it is 0.45 for points that
    /// fill a ball.
    double sheet = heuristic("cloud_scale.sheet", 0.15);
};
COVOL_HEURISTICS CloudScaleHeuristics kCloudScale{};

/// Points that lie on no sheet: stray.cpp.
struct StrayHeuristics {
    /// [median distances to the last neighbour] Distance of the last of common.ring neighbours above which a point is
    /// isolated.
    double far = heuristic("stray.far", 2.5);
};
COVOL_HEURISTICS StrayHeuristics kStray{};

/// Points that fill a solid: filled.cpp.
struct FilledHeuristics {
    /// [radii] Minimum standard deviation along any direction, at all radii, for points that fill a solid: measured
    /// 0.29 to 0.42 for balls, boxes, tori and lattices, at most 0.24 for surfaces with noise and thin parts.
    double min_thickness = heuristic("filled.min_thickness", 0.27);
    /// [fraction of the expected one] Minimum standard deviation along any direction for points that fill a solid,
    /// relative to that of as many random points in a ball; the smaller of this and filled.min_thickness applies.
    double thick = heuristic("filled.thick", 0.8);
};
COVOL_HEURISTICS FilledHeuristics kFilled{};

/// Normals that agree with their indicator function: orientation.cpp. The iteration follows Hou et al., Iterative
/// Poisson surface reconstruction (iPSR), ACM Trans. Graph. 41(4), 2022; the comparison of several attempts and the
/// measure of doubt are added here.
struct OrientationHeuristics {
    /// [indicator] Value above which a point counts as enclosed by another part; with noise, other points have such
    /// values as well.
    double enclosed = heuristic("orientation.enclosed", 0.9);
    /// [indicator] Value above which a point counts as enclosed by another part, with a margin for more noise: in the
    /// second stage of all attempts to orient a cloud, and in the first stage of some.
    double surely_enclosed = heuristic("orientation.surely_enclosed", 1.2);
    /// [spacings] Cell of the finest grid: with smaller cells, normals of single points may be reversed; larger cells
    /// lose thin parts.
    double cell_spacings = heuristic("orientation.cell_spacings", 0.8);
    /// [cells] Maximum number of the finest grid's cells along the longest side of the cloud's largest part, in the
    /// first attempt to orient the cloud: fewer normals change their sides during the iteration on larger cells.
    double first_along = limit("orientation.first_along", 192);
    /// [points] Approximate maximum number of points that the iteration uses: limits the time.
    double max_sampled = limit("orientation.max_sampled", 100000);
    /// [spacings] Distance between a point and the surface above which the surface counts as missing the point.
    double passed_reach = heuristic("orientation.passed_reach", 1.5);
};
COVOL_HEURISTICS OrientationHeuristics kOrientation{};

/// Check of the normals and sensor positions that a file contains: given_sides.cpp.
struct GivenSidesHeuristics {
    /// [fraction of the points] Minimum fraction of the normals whose sides are predicted by the indicator of the other
    /// half of the normals; it is 1/2 for random normals. Also the minimum fraction of the points that are visible from
    /// the sensor: from a wrong position, at least half of a body is hidden.
    double min_right = heuristic("given_sides.min_right", 0.65);
    /// [rounds] Maximum number of times that all normals are replaced by those of their indicator, if noise has moved
    /// points across a thin part, so that they have normals of its opposite side.
    int smoothings = heuristic("given_sides.smoothings", 2);
};
COVOL_HEURISTICS GivenSidesHeuristics kGivenSides{};

/// Normals of local planes, with signs propagated from neighbour to neighbour: propagation.cpp.
struct PropagationHeuristics {
    /// [points] Maximum number of neighbours to which a plane is fitted: limits the time, since the number increases
    /// with the noise.
    double maximum = limit("propagation.maximum", 100);
};
COVOL_HEURISTICS PropagationHeuristics kPropagation{};

/// Scans of one side, oriented by the directions from which each point can be seen: views.cpp.
struct ViewsHeuristics {
    /// [cells] Maximum number of cells along the longest side of the points' box: limits memory.
    int max_view_cells = limit("views.max_view_cells", 256);
    /// [indicator's slope over a cell] Weight of deviations of the screened indicator from 1/2 at a point that
    /// represents the area of a cell's face (Kazhdan and Hoppe, Screened Poisson surface reconstruction, ACM Trans.
    /// Graph. 32(3), 2013).
    double screening = heuristic("views.screening", 2);
};
COVOL_HEURISTICS ViewsHeuristics kViews{};

/// Layers of a scan below others: layers.cpp.
struct LayersHeuristics {
    /// [patches] Maximum number of patches that are reversed tentatively; each requires a solution of the indicator.
    double max_patches = limit("layers.max_patches", 12.0);
};
COVOL_HEURISTICS LayersHeuristics kLayers{};

}  // namespace covol
