#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include <cstddef>

#include "base/heuristic.h"

namespace covol {

/// Spacing and noise of a cloud from quadrics through neighbourhoods that grow: cloud_scale.cpp.
struct CloudScaleHeuristics {
    /// [points] Places whose neighbourhoods are looked at; the medians are theirs.
    std::size_t samples = heuristic("cloud_scale.samples", 2000);
    /// [points] Fewest in a neighbourhood that a quadric (6 unknowns) is fitted to.
    std::size_t minimum = heuristic("cloud_scale.minimum", 12);
    /// [count] Most radii that are tried.
    int radii = heuristic("cloud_scale.radii", 14);
    /// [ratio] Of a radius to the one before: each neighbourhood has twice the points.
    double growth = heuristic("cloud_scale.growth", 1.4142135623730951);
    /// [median distances to the nearest point] The first radius.
    double first_spacings = heuristic("cloud_scale.first_spacings", 3.0);
    /// [radii] Standard deviation from the quadric below which the neighbourhood is a sheet; points that fill a ball
    /// have 0.45.
    double sheet = heuristic("cloud_scale.sheet", 0.15);
    /// [ratio] Growth of that deviation, in radii, at which larger neighbourhoods are given up.
    double worse = heuristic("cloud_scale.worse", 1.05);
};
COVOL_HEURISTICS CloudScaleHeuristics kCloudScale{};

/// Points that lie on no sheet: stray.cpp.
struct StrayHeuristics {
    /// [points] Nearest ones that tell how lonely a point is and what sheet it is on.
    std::size_t neighbours = heuristic("stray.neighbours", 8);
    /// [points] That the usual distance to the last of them is the median of.
    std::size_t samples = heuristic("stray.samples", 20000);
    /// [noises] Least edge of the cells they are searched in: a layer as thick as several spacings has few in a cell of
    /// a spacing.
    double cell_noises = heuristic("stray.cell_noises", 0.5);
    /// [median distances to the last neighbour] A last neighbour farther away makes a point lonely.
    double far = heuristic("stray.far", 2.5);
    /// [distances to the last neighbour] Deviation of the neighbours from their plane, or of the point, from which on a
    /// lonely point is on no sheet.
    double off_plane = heuristic("stray.off_plane", 0.25);
};
COVOL_HEURISTICS StrayHeuristics kStray{};

/// Points that fill a solid: filled.cpp.
struct FilledHeuristics {
    /// [points] Whose neighbourhoods are looked at.
    std::size_t samples = heuristic("filled.samples", 400);
    /// [points] Fewest in a neighbourhood.
    double min_neighbours = heuristic("filled.min_neighbours", 8);
    /// [radii] Least standard deviation along any direction, at all radii, of points that fill a solid: measured 0.29
    /// to 0.42 of balls, boxes, tori and lattices, 0.24 and less of surfaces with noise and thin parts.
    double min_thickness = heuristic("filled.min_thickness", 0.27);
    /// [of the expected one] The same of few points, which measure less.
    double thick = heuristic("filled.thick", 0.8);
    /// [distances of the points] Cell of the grid of their density: its splines hold about 70 points.
    double cell_spacings = heuristic("filled.cell_spacings", 2);
};
COVOL_HEURISTICS FilledHeuristics kFilled{};

/// Normals that agree with their indicator function: orientation.cpp. Hou et al., Iterative Poisson surface
/// reconstruction (iPSR), ACM Trans. Graph. 41(4), 2022, has the iteration; tries and doubts are ours.
struct OrientationHeuristics {
    /// [cells] Of the grid of the density whose gradient is the first guess.
    double first_cells = heuristic("orientation.first_cells", 3.2);
    /// [indicator] At a point beyond which another part encloses it already; noise brings points there that are none of
    /// these.
    double enclosed = heuristic("orientation.enclosed", 0.9);
    /// [indicator] The same where more noise is allowed for.
    double surely_enclosed = heuristic("orientation.surely_enclosed", 1.2);
    /// [spacings] Cell of the finest lattice: smaller ones let single points turn, larger ones lose thin parts.
    double cell_spacings = heuristic("orientation.cell_spacings", 0.8);
    /// [noises] The same, at least.
    double cell_noises = heuristic("orientation.cell_noises", 1.0);
    /// [spacings] Smallest cell of any try.
    double min_spacings = heuristic("orientation.min_spacings", 0.5);
    /// [indicator] That its mean over the points may differ from 1/2 without doubt.
    double off_half = heuristic("orientation.off_half", 0.02);
    /// [ratio] Of what is beyond that, against the share of normals that turned, among tries: walls that run into each
    /// other turn less than those that waver.
    double off_weight = heuristic("orientation.off_weight", 2);
    /// [cells] Of the lattice on which tries are compared, in those of the first: too fine for walls to run together.
    double strain_cells = heuristic("orientation.strain_cells", 0.67);
    /// [cells] Of the last try, in those of the first: noise makes the first cells wider than thin walls.
    double thin_cells = heuristic("orientation.thin_cells", 0.44);
    /// [cells] Of the first lattice, above which the one that was chosen is too coarse for what its normals tell.
    double coarse = heuristic("orientation.coarse", 1.2);
    /// [spacings] Noise below which a surface may be as fine as the tries were compared.
    double little_noise = heuristic("orientation.little_noise", 0.5);
    /// [share of the points] That a surface passes by and that ask for that.
    double many_passed = heuristic("orientation.many_passed", 0.02);
    /// [points] That iterate, on the surface in the square of a lattice's cell.
    double sampled_per_cell = heuristic("orientation.sampled_per_cell", 4);
    /// [cells] Along the longest side, at most, in the first tries.
    double first_along = heuristic("orientation.first_along", 192);
    /// [points] Most of those: time.
    double max_sampled = heuristic("orientation.max_sampled", 100000);
    /// [points] Fewest of those: where parts lie so far apart that the lattice has each in a cell.
    std::size_t min_sampled = heuristic("orientation.min_sampled", 100);
    /// [spacings] Edge of the cells that those are taken from.
    double sample_spacings = heuristic("orientation.sample_spacings", 4);
    /// [spacings] Noise below which the nearest points tell the sheet that a point is on.
    double sharp = heuristic("orientation.sharp", 0.2);
    /// [spacings] Noise up to which points that enclose nothing are oriented from neighbour to neighbour.
    double noise_of_sheets = heuristic("orientation.noise_of_sheets", 0.3);
    /// [rounds] Of leaving out stray points.
    int stray_rounds = heuristic("orientation.stray_rounds", 3);
    /// [share of the points] That a round has to leave out for another one.
    double many_stray = heuristic("orientation.many_stray", 0.005);
    /// [share of the points] Of given normals with opposite ones beside them; good ones have less than 0.001 without
    /// noise and 0.005 at any.
    double few_torn = heuristic("orientation.few_torn", 0.002);
    /// [share of the points] Of given normals against an orientation that settled; those of which a part is turned as a
    /// whole have more than 0.1.
    double contradicted = heuristic("orientation.contradicted", 0.03);
    /// [share of the points] Doubt below which points enclose a solid: of closed shapes up to 0.013, of scans of one
    /// side from 0.026 to 0.19.
    double settled = heuristic("orientation.settled", 0.014);
    /// [share of the area] Without points, below which they enclose one all the same: of closed shapes less than 0.01,
    /// of scans of one side 0.14 to 0.4.
    double bare = heuristic("orientation.bare", 0.05);
    /// [ratio] Of the points that an orientation that is in doubt passes by to those that views do, below which they
    /// enclose a solid all the same: of closed shapes and shells open at one end 0.06 to 0.21, of scans of one side
    /// 0.83 to 0.97, of thin noisy shells 0.44.
    double fewer_passed = heuristic("orientation.fewer_passed", 1.0 / 3);
    /// [share of the area] Without points, above which what closes them is larger than what they are on: of closed
    /// shapes up to 0.04, of scans of some sides 0.14 to 0.37, of those from the air 0.66 to 0.85.
    double mostly_bare = heuristic("orientation.mostly_bare", 0.5);
    /// [spacings] Distance from a point at which the surface passes it by.
    double passed_reach = heuristic("orientation.passed_reach", 1.5);
    /// [spacings or noises] Distance to the nearest point from which on the surface is bare.
    double bare_reach = heuristic("orientation.bare_reach", 2);
};
COVOL_HEURISTICS OrientationHeuristics kOrientation{};

/// Normals and sensors of the file, checked: given_sides.cpp.
struct GivenSidesHeuristics {
    /// [share of the normals] That turn of an orientation beyond doubt.
    double few_turned = heuristic("given_sides.few_turned", 0.002);
    /// [share of the points] Fewest with a normal or sensor for them to be used.
    double min_known = heuristic("given_sides.min_known", 0.5);
    /// [share of the normals] That the other half has to foresee; of normals without a meaning it is half.
    double min_predicted = heuristic("given_sides.min_predicted", 0.65);
    /// [share of the points] That their sensor has to see: a body hides at least half of itself from a wrong place.
    double min_free_views = heuristic("given_sides.min_free_views", 0.7);
    /// [spacings or noises] Cells of the lattice on which points judge each other: about four points each.
    double vote_spacings = heuristic("given_sides.vote_spacings", 2);
    /// [rounds] Of turning normals that the others contradict.
    int turns = heuristic("given_sides.turns", 3);
    /// [indicator's step over a cell] Slope from which on the indicator contradicts a normal.
    double speaks_against = heuristic("given_sides.speaks_against", 0.1);
    /// [indicator] At a point and on both of its sides, from which on it is within the solid: halfway from a border.
    double enclosed = heuristic("given_sides.enclosed", 0.75);
    /// [rounds] Of smoothing normals that noise has mixed.
    int smoothings = heuristic("given_sides.smoothings", 2);
    /// [points] Neighbours whose normals are compared.
    std::size_t beside = heuristic("given_sides.beside", 8);
    /// [sine] Of a neighbour's height over the tangent plane, below which both are of one sheet.
    double flat = heuristic("given_sides.flat", 0.3);
    /// [cosine] Between normals of one sheet that is torn there.
    double opposite = heuristic("given_sides.opposite", -0.5);
};
COVOL_HEURISTICS GivenSidesHeuristics kGivenSides{};

/// Normals of local planes, and their signs from neighbour to neighbour: propagation.cpp.
struct PropagationHeuristics {
    /// [noises] Radius of the neighbourhood that a plane is fitted to.
    double plane_noises = heuristic("propagation.plane_noises", 4);
    /// [points] Fewest in it.
    double fewest = heuristic("propagation.fewest", 12);
    /// [points] Most in it.
    double maximum = heuristic("propagation.maximum", 100);
    /// [points] Neighbours that a point may take its sign from.
    std::size_t neighbours = heuristic("propagation.neighbours", 10);
};
COVOL_HEURISTICS PropagationHeuristics kPropagation{};

/// Clouds of one side, by where each point can be seen from: views.cpp.
struct ViewsHeuristics {
    /// [rays] From each cell, evenly over the sphere.
    int rays = heuristic("views.rays", 96);
    /// [cells] Along the longest side: memory.
    int max_view_cells = heuristic("views.max_view_cells", 256);
    /// [cells] Start of a ray: beyond the point's own sheet.
    double first_step = heuristic("views.first_step", 2.5);
    /// [spacings or noises] Edge of the cells that stop a view: about four points each.
    double view_spacings = heuristic("views.view_spacings", 2.0);
    /// [spacings or noises] Edge of the cells of the indicator whose topology counts.
    double coarse_spacings = heuristic("views.coarse_spacings", 2.4);
    /// [spacings or noises] Edge of the cells of the screened indicator.
    double fine_spacings = heuristic("views.fine_spacings", 1.2);
    /// [share of the points] That are free in one direction and not in the opposite one, from which on it is the sky.
    double sky = heuristic("views.sky", 0.01);
    /// [weight] Of each point's own free directions, against the sky's.
    double beside_sky = heuristic("views.beside_sky", 0.1);
    /// [share of all directions] Less those opposite, from which a point is seen on a side.
    double min_free = heuristic("views.min_free", 0.01);
    /// [indicator's slope over a cell] Weight with which points hold the screened indicator (Kazhdan and Hoppe,
    /// Screened Poisson surface reconstruction, ACM Trans. Graph. 32(3), 2013).
    double screening = heuristic("views.screening", 4);
};
COVOL_HEURISTICS ViewsHeuristics kViews{};

/// Layers of a scan below others: layers.cpp. Lengths are in the distance from which on points are not of one sheet.
struct LayersHeuristics {
    /// [distances between sheets] Edge of the cells whose points turn together.
    double cell = heuristic("layers.cell", 2);
    /// [distances between sheets] Of a layer below the one that hides it.
    double farthest_layer = heuristic("layers.farthest_layer", 6);
    /// [share of a patch's points] That may be farther from the surface once they are turned.
    double max_away = heuristic("layers.max_away", 0.2);
    /// [cells of the indicator] Surface without points as near is bare.
    double bare_cells = heuristic("layers.bare_cells", 2);
    /// [areas of the patch] Of bare surface: a cavity's far side is not much larger than its near one, a ring's hole
    /// is.
    double max_gain = heuristic("layers.max_gain", 1.5);
    /// [patches] That are tried; each costs a solution.
    int max_patches = heuristic("layers.max_patches", 12);
    /// [points] Fewest of a patch.
    std::size_t min_points = heuristic("layers.min_points", 12);
};
COVOL_HEURISTICS LayersHeuristics kLayers{};

}  // namespace covol
