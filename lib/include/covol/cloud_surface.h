#pragma once
#include <memory>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/orientation.h"
#include "covol/run.h"

namespace covol {

class Creases;

/// What surface_from_cloud() found out about the points.
struct CloudReport {
    double spacing = 0;              ///< CloudScale::spacing
    double turned = 0;               ///< Orientation::turned
    double noise = 0;                ///< standard deviation of the points from the surface, median
    double radius = 0;               ///< of the neighbourhoods that were averaged, median
    double nearest = 0;              ///< CloudScale::nearest
    double near_reach = 0;           ///< CloudScale::near_reach
    double near_noise = 0;           ///< CloudScale::near_noise
    int iterations = 0;              ///< of the orientation
    bool encloses = true;            ///< CloudOrientation::encloses
    bool fills = false;              ///< CloudOrientation::fills
    double indicator_cell = 0;       ///< of the indicator's finest lattice
    std::size_t stray = 0;           ///< points far from all surfaces, left out
    std::size_t enclosed = 0;        ///< CloudOrientation::enclosed
    std::size_t bare_nodes = 0;      ///< near points that form no sheet: there the indicator is the surface
    std::size_t dropped_pieces = 0;  ///< pieces of the surface that hardly any point supports
    std::size_t joined_pieces = 0;   ///< small pieces, joined to the nearest piece along points
    std::size_t held_voxels = 0;     ///< kept to the indicator's topology, which is simpler than that of the points
    std::size_t layered = 0;         ///< Orientation::layered
    HintsReport hints;               ///< CloudOrientation::hints
};

struct CloudSurface {
    FloatGridPtr u;
    CloudReport report;
    std::shared_ptr<const Creases> creases;  ///< where sheets meet; null: nowhere
};

/// The closed surface behind points without normals, as a start (negative inside).
///
/// The points are oriented by the indicator function that they define (orient_cloud()). Near them the level set is the
/// signed distance to local quadrics, fitted to neighbourhoods as wide as their noise requires, and blended (implicit
/// moving least squares; Kolluri, Provably good moving least squares, ACM Trans. Algorithms 4(2), 2008; Ohtake and
/// others, Multi-level partition of unity implicits, 2003); where there are no points it is the indicator's. For points
/// that enclose nothing it is the screened indicator. If the indicator has fewer pieces and handles, its topology is
/// kept.
/// @throws Error InvalidInput (no surface), Cancelled.
[[nodiscard]] COVOL_API CloudSurface surface_from_cloud(const Domain& domain, const CloudOrientation& cloud,
                                                        const RunContext& run = {});

}  // namespace covol
