#pragma once
// Orientation from the hints that files contain for their points: normals or sensor positions.
#include "covol/orientation.h"

namespace covol::cloud {

struct GivenSides {
    HintsReport report;
    std::vector<Vec3> given;  ///< the normals that were checked
    Orientation orientation;  ///< from the given normals, if they are used
    double torn = 0;          ///< fraction of the points with an opposite normal beside them on their own sheet
};

/// Uses given normals, or normals of local planes on the side of the sensor. Their reliability is cross-validated
/// between two halves of the points: each half's indicator function must decrease along the other half's normals. If
/// nearly all are right they are left unchanged; isolated ones are reversed if all their neighbours contradict them.
/// @param hints  of the points
/// @param cell   of the indicator's lattice, world units
[[nodiscard]] GivenSides given_sides(const std::vector<Vec3>& points, const PointHints& hints, const CloudScale& scale,
                                     double cell, const RunContext& run);

/// For each point whether the position and both of its sides are inside the solid, as where two walls touch or two
/// bodies intersect: no surface passes there, whatever the normals. Most of the points around such a point must be
/// inside as well.
/// @param normals  of either sign, 0 if a point has none: it is never enclosed
/// @param reach    distance from a point beyond which its own effect on the indicator is negligible, world units
[[nodiscard]] std::vector<char> find_enclosed(const std::vector<Vec3>& points, const std::vector<Vec3>& normals,
                                              const Indicator& indicator, const CloudScale& scale, double reach);

/// Fraction of the given normals, reversed if all are, that agree with the orientation's indicator; 0 if there are
/// none.
[[nodiscard]] double agreeing(const std::vector<Vec3>& points, const std::vector<Vec3>& given,
                              const Orientation& orientation, bool turned_over);

}  // namespace covol::cloud
