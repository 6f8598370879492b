#pragma once
#include <memory>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/orientation.h"
#include "covol/run.h"

namespace covol {

class Creases;

/// Measurements of surface_from_cloud().
struct CloudReport {
    double spacing = 0;  ///< CloudScale::spacing
    double turned = 0;   ///< Orientation::turned
    /// The standard deviation of the points from their local quadric, median over the quadrics; CloudScale::noise if
    /// there are no quadrics. World units.
    double noise = 0;
    double radius = 0;           ///< median radius of the neighbourhoods to which the quadrics were fitted, world units
    double nearest = 0;          ///< CloudScale::nearest
    double near_reach = 0;       ///< CloudScale::near_reach
    double near_noise = 0;       ///< CloudScale::near_noise
    int iterations = 0;          ///< Orientation::iterations
    bool encloses = true;        ///< CloudOrientation::encloses
    bool fills = false;          ///< CloudOrientation::fills
    double indicator_cell = 0;   ///< cell size of the indicator's finest lattice, world units
    std::size_t stray = 0;       ///< CloudOrientation::stray
    std::size_t enclosed = 0;    ///< CloudOrientation::enclosed
    std::size_t bare_nodes = 0;  ///< number of positions near the points to which no quadric could be fitted, because
                                 ///< the points form no sheet there; the surface follows the indicator there
    /// number of pieces of the surface that were removed because they have too few points
    std::size_t dropped_pieces = 0;
    /// number of small pieces of the surface that were joined to the nearest piece because there are points all along
    /// the gap between both
    std::size_t joined_pieces = 0;
    std::size_t held_voxels = 0;  ///< number of voxels whose sign is that of the indicator, so that the surface has the
                                  ///< indicator's simpler topology
    std::size_t layered = 0;      ///< Orientation::layered
    HintsReport hints;            ///< CloudOrientation::hints
};

struct CloudSurface {
    FloatGridPtr u;
    CloudReport report;
    std::shared_ptr<const Creases> creases;  ///< sharp edges at which two sheets meet; null if there are none
};

/// Reconstructs the closed surface that a cloud samples, as a start (negative inside).
///
/// Near the points, the level set is a blend of the signed distances to local quadrics (implicit moving least squares;
/// Kolluri, Provably good moving least squares, ACM Trans. Algorithms 4(2), 2008; Ohtake and others, Multi-level
/// partition of unity implicits, 2003). Each quadric is fitted to a neighbourhood that is as wide as the noise of the
/// points requires. Elsewhere the level set follows the level 1/2 of the cloud's indicator function, which is
/// Orientation::screened or, if that is null, Orientation::indicator. If the points enclose nothing or fill a solid,
/// the whole surface is this level.
///
/// If the level set has more pieces and handles in total than the indicator, it gets the indicator's topology, unless
/// this would reduce the number of large pieces or change the sign of too many voxels.
/// @param cloud  the result of orient_cloud()
/// @throws Error InvalidInput (no surface), Cancelled.
[[nodiscard]] COVOL_API CloudSurface surface_from_cloud(const Domain& domain, const CloudOrientation& cloud,
                                                        const RunContext& run = {});

}  // namespace covol
