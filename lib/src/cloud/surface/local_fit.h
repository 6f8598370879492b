#pragma once
// Pieces of the surface behind an oriented cloud: quadrics over neighbourhoods as wide as the noise asks for and the
// shape allows.
#include <memory>
#include <vector>

#include "cloud/surface/sheet.h"
#include "covol/domain.h"
#include "covol/orientation.h"
#include "covol/run.h"

namespace covol::cloud {

/// Points with outward normals, each of which may stand for several.
struct OrientedCloud {
    std::vector<Vec3> points, normals;
    std::vector<float> counts;
    std::vector<float> squares_off;  ///< means of squared distances to the indicator's surface; empty: not known
    [[nodiscard]] std::size_t size() const { return points.size(); }
};

/// Means of the points of each cell of the given edge, those on the two sides of a sheet apart.
[[nodiscard]] OrientedCloud thinned(const OrientedCloud& cloud, double edge);

/// A sheet, or several that meet, fitted to a neighbourhood. Of several the sheet itself is a plane through where they
/// lie above the origin, across their mean normal.
struct Quadric : Sheet {
    double radius = 0;                     ///< of the neighbourhood that it was fitted to
    double min_radius = 0;                 ///< of the smallest that tells anything
    double noise = 0;                      ///< standard deviation of the points from it, along each axis
    double apart = 0;                      ///< edge of the cells that its node and those beside it were taken from
    std::shared_ptr<const Crease> crease;  ///< null: one sheet
    [[nodiscard]] double distance(const Vec3& world) const {
        return crease ? crease->distance(world) : Sheet::distance(world);
    }
};

/// Quadrics at the nodes, by weighted least squares. The neighbourhood is the largest of a geometric sequence whose fit
/// agrees with those of all smaller ones up to noise (Lepski, Theory Probab. Appl. 35, 1990, for points: Wang and Mitra
/// 2004, Goldenshluger and Nemirovski 1997): wide where noise has to be averaged, narrow at edges and tips. What noise
/// of the same size along the surface bends is straightened: it lowers the mean height of points by half its variance
/// times the Laplacian. Where the smallest neighbourhood's points are much farther from its quadric than from the
/// indicator's surface it has sheets of several folds in it, and there is no quadric. Where sheets meet in an
/// edge or a corner, fit_crease() gives these.
/// @param nodes    where; their normals say which side of a sheet they are on
/// @param spacing  mean distance of neighbours on the surface, of `cloud`'s points as they were measured
/// @return as many as there are nodes; radius 0 where no neighbourhood is a sheet
[[nodiscard]] std::vector<Quadric> fit_quadrics(const OrientedCloud& nodes, const OrientedCloud& cloud, double spacing,
                                                const RunContext& run);

/// Quadrics all over a cloud, as fit_quadrics() makes them: at nodes taken from cells of the given edge, or of two,
/// four or eight times as much where the neighbourhoods are so wide that more nodes would tell the same.
/// @param places  the cloud's points, moved to about where the surface is; the nodes are means of them
/// @param spacing as in fit_quadrics()
/// @param noise   standard deviation along each axis, about; creases are looked for in neighbourhoods that are wide
///                enough for it
/// @param bare    how many nodes have none
[[nodiscard]] std::vector<Quadric> quadrics_over(const OrientedCloud& places, const OrientedCloud& cloud, double edge,
                                                 double spacing, double noise, std::size_t& bare,
                                                 const RunContext& run);

}  // namespace covol::cloud
