#pragma once
// Quadrics that represent the surface that an oriented cloud samples, fitted to neighbourhoods as wide as the noise
// requires and the shape permits.
#include <memory>
#include <vector>

#include "cloud/surface/sheet.h"
#include "covol/domain.h"
#include "covol/orientation.h"
#include "covol/run.h"

namespace covol::cloud {

/// Points with outward normals. Each may be the mean of several points, whose number is its count.
struct OrientedCloud {
    std::vector<Vec3> points, normals;
    std::vector<float> counts;
    std::vector<float> squares_off;  ///< means of squared distances to the indicator's surface; empty: unknown
    [[nodiscard]] std::size_t size() const { return points.size(); }
};

/// The means of the points in each cell of the given edge length, separately for the two sides of a sheet.
[[nodiscard]] OrientedCloud thinned(const OrientedCloud& cloud, double edge);

/// A sheet, or several sheets that meet, fitted to a neighbourhood. If there are several, the base class Sheet is the
/// plane perpendicular to their mean normal, through the point at which the line along that normal from the origin
/// intersects them.
struct Quadric : Sheet {
    double radius = 0;                     ///< radius of the neighbourhood of the fit; 0: no fit
    double min_radius = 0;                 ///< radius of the smallest neighbourhood with enough points
    double noise = 0;                      ///< standard deviation of the points along its normal
    double apart = 0;                      ///< edge length of the cells in which points were averaged to nodes
    std::shared_ptr<const Crease> crease;  ///< null: a single sheet
    [[nodiscard]] double distance(const Vec3& world) const {
        return crease ? crease->distance(world) : Sheet::distance(world);
    }
};

/// Quadrics at the nodes, by weighted least squares. The neighbourhood is the largest of a geometric sequence whose fit
/// agrees with those of all smaller ones up to noise (Lepski, Theory Probab. Appl. 35, 1990, for points: Wang and Mitra
/// 2004, Goldenshluger and Nemirovski 1997): wide where noise must be averaged, narrow at edges and tips. The bias from
/// noise along a curved surface is corrected: the noise changes the mean height of points by half its variance times
/// the surface's Laplacian. If the points of the smallest neighbourhood are much farther from its quadric than from the
/// indicator's surface, the neighbourhood contains several sheets and there is no quadric. Sheets that meet in an edge
/// or a corner are found by fit_crease().
/// @param nodes    positions, with normals that determine the side of the sheet
/// @param spacing  mean distance between neighbouring points of `cloud`
/// @return one for each node; radius 0 if no neighbourhood is a sheet
[[nodiscard]] std::vector<Quadric> fit_quadrics(const OrientedCloud& nodes, const OrientedCloud& cloud, double spacing,
                                                const RunContext& run);

/// Quadrics for a whole cloud, as by fit_quadrics(). The nodes are taken from cells of the given edge length, or of
/// two, four or eight times that length if the neighbourhoods are so wide that more nodes are not needed.
/// @param places  the cloud's points, moved close to the surface; the nodes are means of them
/// @param spacing as in fit_quadrics()
/// @param noise   approximate standard deviation of the points along each axis, which determines the radius of the
/// neighbourhoods in which creases are sought
/// @param bare    out: number of nodes without a quadric
[[nodiscard]] std::vector<Quadric> quadrics_over(const OrientedCloud& places, const OrientedCloud& cloud, double edge,
                                                 double spacing, double noise, std::size_t& bare,
                                                 const RunContext& run);

}  // namespace covol::cloud
