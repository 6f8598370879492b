#pragma once
// Orientation from the hints that files contain for their points: normals or sensor positions.
#include "covol/orientation.h"

namespace covol::cloud {

struct GivenSides {
    HintsReport report;
    std::vector<Vec3> given;  ///< the normals that were checked
    Orientation orientation;  ///< from the given normals, if they are used
    double torn = 0;          ///< fraction of the points with a neighbour of opposite normal on their own sheet
};

/// Uses given normals, or normals of local planes on the side of the sensor. Their reliability is cross-validated
/// between two halves of the points: each half's indicator function must decrease along the other half's normals.
/// If too few agree, they are not used. Otherwise, normals along which the indicator clearly increases are reversed; if
/// it still increases along more than kCloud.few of all normals, all are replaced by the normals of the indicator.
/// @param hints  of the points
/// @param cell   cell size of the indicator's grid, world units
[[nodiscard]] GivenSides given_sides(const std::vector<Vec3>& points, const PointHints& hints, const CloudScale& scale,
                                     double cell, const RunContext& run);

/// For each point, whether it is enclosed: the point itself and the two positions at the distance `reach` along its
/// normal are inside the solid, and so are those of most of its neighbours. This occurs where two walls touch or two
/// bodies intersect.
/// @param normals  of either sign; 0 if unknown: such points never count as enclosed
/// @param reach    distance from a point beyond which its own effect on the indicator is negligible, world units
[[nodiscard]] std::vector<char> find_enclosed(const std::vector<Vec3>& points, const std::vector<Vec3>& normals,
                                              const Indicator& indicator, const CloudScale& scale, double reach);

/// Fraction of the given normals that agree with the orientation's indicator; 0 if there are none.
/// @param turned_over  whether the given normals point inwards
[[nodiscard]] double agreeing(const std::vector<Vec3>& points, const std::vector<Vec3>& given,
                              const Orientation& orientation, bool turned_over);

}  // namespace covol::cloud
