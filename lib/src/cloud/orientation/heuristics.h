#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include <cstddef>

#include "base/heuristics.h"

namespace covol {

/// Spacing and noise of a cloud from quadrics fitted to neighbourhoods of increasing size: cloud_scale.cpp.
struct CloudScaleHeuristics {
    /// [points] Number of sampled points from whose neighbourhoods the medians are computed.
    std::size_t samples = heuristic("cloud_scale.samples", 2000);
    /// [count] Maximum number of radii that are tried.
    int radii = heuristic("cloud_scale.radii", 14);
    /// [median distances to the nearest point] The first radius.
    double first_spacings = heuristic("cloud_scale.first_spacings", 3.0);
    /// [radii] Standard deviation from the quadric below which the neighbourhood is a sheet; it is 0.45 for points that
    /// fill a ball.
    double sheet = heuristic("cloud_scale.sheet", 0.15);
    /// [ratio] Ratio of that deviation to its minimum so far, both in radii, at which the search for larger
    /// neighbourhoods ends.
    double worse = heuristic("cloud_scale.worse", 1.05);
};
COVOL_HEURISTICS CloudScaleHeuristics kCloudScale{};

/// Points that lie on no sheet: stray.cpp.
struct StrayHeuristics {
    /// [points] Number of sampled points for the median distance to the last of common.ring neighbours.
    std::size_t samples = heuristic("stray.samples", 20000);
    /// [noises] Length from which the edge of the search cells is computed instead of the spacing, if it is larger: in
    /// a layer several spacings thick, smaller cells have few points.
    double cell_noises = heuristic("stray.cell_noises", 0.5);
    /// [median distances to the last neighbour] Distance of the last of common.ring neighbours above which a point is
    /// isolated.
    double far = heuristic("stray.far", 2.5);
};
COVOL_HEURISTICS StrayHeuristics kStray{};

/// Points that fill a solid: filled.cpp.
struct FilledHeuristics {
    /// [points] Number of sampled points whose neighbourhoods are examined.
    std::size_t samples = heuristic("filled.samples", 400);
    /// [radii] Minimum standard deviation along any direction, at all radii, for points that fill a solid: measured
    /// 0.29 to 0.42 for balls, boxes, tori and lattices, at most 0.24 for surfaces with noise and thin parts.
    double min_thickness = heuristic("filled.min_thickness", 0.27);
    /// [fraction of the expected one] The same, relative to the standard deviation that is expected for the number of
    /// points; the smaller of the two minima applies.
    double thick = heuristic("filled.thick", 0.8);
};
COVOL_HEURISTICS FilledHeuristics kFilled{};

/// Normals that agree with their indicator function: orientation.cpp. The iteration follows Hou et al., Iterative
/// Poisson surface reconstruction (iPSR), ACM Trans. Graph. 41(4), 2022; the comparison of several attempts and the
/// measure of doubt are added here.
struct OrientationHeuristics {
    /// [cells] Cell of the density grid whose gradient determines the initial normals.
    double first_cells = heuristic("orientation.first_cells", 3.2);
    /// [indicator] Value above which a point counts as enclosed by another part; with noise, other points have such
    /// values as well.
    double enclosed = heuristic("orientation.enclosed", 0.9);
    /// [indicator] The same with a margin for more noise.
    double surely_enclosed = heuristic("orientation.surely_enclosed", 1.2);
    /// [spacings] Cell of the finest grid: with smaller cells, normals of single points may be reversed; larger cells
    /// lose thin parts.
    double cell_spacings = heuristic("orientation.cell_spacings", 0.8);
    /// [spacings] Minimum cell of any attempt.
    double min_spacings = heuristic("orientation.min_spacings", 0.5);
    /// [ratio] Weight, in the measure of doubt, of the deviation of the mean indicator from 1/2 beyond cloud.some,
    /// relative to the fraction of normals that turned: few normals turn if two walls merge.
    double off_weight = heuristic("orientation.off_weight", 2);
    /// [cells of the first attempt] Cell of the third attempt; also, relative to the finest cell, of the grid on which
    /// attempts are compared. Small enough to keep walls separate.
    double strain_cells = heuristic("orientation.strain_cells", 0.67);
    /// [cells of the first attempt] Cell of the fourth attempt: noise may make the first cells wider than thin walls.
    double thin_cells = heuristic("orientation.thin_cells", 0.44);
    /// [cells of the first attempt] Cell above which the indicator is recomputed with smaller cells; ratio of the first
    /// to the finest cell above which a fifth attempt uses the finest.
    double coarse = heuristic("orientation.coarse", 1.2);
    /// [spacings] Noise below which an indicator that misses points may be recomputed with smaller cells.
    double little_noise = heuristic("orientation.little_noise", 0.5);
    /// [points] Number of points that the iteration uses per area of a cell's face.
    double sampled_per_cell = heuristic("orientation.sampled_per_cell", 4);
    /// [cells] Maximum along the longest side in the first attempts.
    double first_along = limit("orientation.first_along", 192);
    /// [points] Maximum number that the iteration uses: limits the time.
    double max_sampled = limit("orientation.max_sampled", 100000);
    /// [points] Minimum number that the iteration uses, for parts so far apart that each lies in one cell of the grid.
    std::size_t min_sampled = heuristic("orientation.min_sampled", 100);
    /// [spacings] Edge of the cells by which points are ordered for sampling.
    double sample_spacings = heuristic("orientation.sample_spacings", 4);
    /// [spacings] Noise below which the nearest points determine the sheet of a point.
    double sharp = heuristic("orientation.sharp", 0.2);
    /// [spacings] Noise up to which points that enclose nothing are oriented from neighbour to neighbour.
    double noise_of_sheets = heuristic("orientation.noise_of_sheets", 0.3);
    /// [fraction of the points] Minimum that a round must remove as stray for another round to follow.
    double many_stray = heuristic("orientation.many_stray", 0.005);
    /// [fraction of the points] Maximum whose given normals contradict the computed orientation of a solid, for given
    /// normals to be used; the fraction is above 0.1 if the normals of a part are all reversed.
    double contradicted = heuristic("orientation.contradicted", 0.03);
    /// [fraction of the points] Doubt below which points count as enclosing a solid: it is up to 0.013 for closed
    /// shapes, 0.026 to 0.19 for scans of one side.
    double settled = heuristic("orientation.settled", 0.014);
    /// [fraction of the area] Bare fraction of the surface below which points count as enclosing a solid in spite of
    /// doubt: it is less than 0.01 for closed shapes, 0.14 to 0.4 for scans of one side.
    double bare = heuristic("orientation.bare", 0.05);
    /// [ratio] Ratio of the points that the surface of a doubtful orientation misses to those that the surface from
    /// views misses, below which points count as enclosing a solid: it is 0.06 to 0.21 for closed shapes and shells
    /// open at one end, 0.83 to 0.97 for scans of one side, 0.44 for thin noisy shells.
    double fewer_passed = heuristic("orientation.fewer_passed", 1.0 / 3);
    /// [spacings] Distance beyond which the surface misses a point.
    double passed_reach = heuristic("orientation.passed_reach", 1.5);
};
COVOL_HEURISTICS OrientationHeuristics kOrientation{};

/// Check of the normals and sensor positions that a file contains: given_sides.cpp.
struct GivenSidesHeuristics {
    /// [fraction of the normals] Minimum that the indicator of the other half of the normals must predict; it predicts
    /// half of random normals.
    double min_predicted = heuristic("given_sides.min_predicted", 0.65);
    /// [fraction of the points] Minimum that must be visible from the sensor: from a wrong position, at least half of a
    /// body is hidden.
    double min_free_views = heuristic("given_sides.min_free_views", 0.7);
    /// [indicator's step over a cell] Increase of the indicator along a normal from which on it contradicts the normal.
    double speaks_against = heuristic("given_sides.speaks_against", 0.1);
    /// [rounds] Maximum number of times that normals mixed by noise are replaced by those of their indicator.
    int smoothings = heuristic("given_sides.smoothings", 2);
    /// [sine] Maximum sine of a neighbour's elevation above the tangent plane, for both points to be on one sheet.
    double flat = heuristic("given_sides.flat", 0.3);
};
COVOL_HEURISTICS GivenSidesHeuristics kGivenSides{};

/// Normals of local planes, with signs propagated from neighbour to neighbour: propagation.cpp.
struct PropagationHeuristics {
    /// [points] Maximum number of neighbours to which a plane is fitted.
    double maximum = heuristic("propagation.maximum", 100);
    /// [points] Number of neighbours of each point in the graph along which signs are propagated.
    std::size_t neighbours = heuristic("propagation.neighbours", 10);
};
COVOL_HEURISTICS PropagationHeuristics kPropagation{};

/// Scans of one side, oriented by the directions from which each point can be seen: views.cpp.
struct ViewsHeuristics {
    /// [rays] Number of rays from each cell, evenly distributed over the sphere.
    int rays = heuristic("views.rays", 96);
    /// [cells] Maximum along the longest side: limits memory.
    int max_view_cells = limit("views.max_view_cells", 256);
    /// [cells] Start of a ray, beyond the point's own sheet.
    double first_step = heuristic("views.first_step", 2.5);
    /// [spacings or noises] Edge of the cells of the indicator that determines the topology.
    double coarse_spacings = heuristic("views.coarse_spacings", 2.4);
    /// [spacings or noises] Edge of the cells of the screened indicator.
    double fine_spacings = heuristic("views.fine_spacings", 1.2);
    /// [fraction of the points] Excess of points with a free view in one direction over those with a free view in the
    /// opposite direction, above which the scan has a common direction of view, the sky.
    double sky = heuristic("views.sky", 0.01);
    /// [weight] Weight of each point's own free directions relative to the direction of the sky.
    double beside_sky = heuristic("views.beside_sky", 0.1);
    /// [fraction of all directions] Excess of free directions on one side over the other from which a point is seen on
    /// that side.
    double min_free = heuristic("views.min_free", 0.01);
    /// [indicator's slope over a cell] Weight of the points in the screened indicator (Kazhdan and Hoppe, Screened
    /// Poisson surface reconstruction, ACM Trans. Graph. 32(3), 2013).
    double screening = heuristic("views.screening", 4);
};
COVOL_HEURISTICS ViewsHeuristics kViews{};

/// Layers of a scan below others: layers.cpp. Lengths are relative to the distance between sheets: the distance from
/// which on points are not of one sheet.
struct LayersHeuristics {
    /// [distances between sheets] Maximum depth of a layer below the one that hides it.
    double farthest_layer = heuristic("layers.farthest_layer", 6);
    /// [fraction of a patch's points] Maximum that may be far from the surface after the patch is reversed.
    double max_away = heuristic("layers.max_away", 0.2);
    /// [areas of the patch] Maximum decrease of the bare surface: the far side of a cavity is not much larger than its
    /// near side, unlike the hole of a ring.
    double max_gain = heuristic("layers.max_gain", 1.5);
    /// [patches] Maximum number that are reversed on trial; each trial requires a new solution of the indicator.
    int max_patches = limit("layers.max_patches", 12);
};
COVOL_HEURISTICS LayersHeuristics kLayers{};

}  // namespace covol
