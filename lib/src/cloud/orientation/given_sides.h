#pragma once
// Orientation by what files tell of their points: normals, or where the sensor was.
#include "covol/orientation.h"

namespace covol::cloud {

struct GivenSides {
    HintsReport report;
    std::vector<Vec3> given;  ///< the normals that were judged
    Orientation orientation;  ///< of them, where they are used
    double torn = 0;          ///< share of the points with an opposite normal beside them on their own sheet
};

/// Normals as they are given, or those of local planes on the side from which the sensor saw them. Whether they are to
/// be believed the two halves of the points tell each other: each half's indicator function has to fall in the
/// direction of the other half's normals. Where nearly all are right they stay as they are; single ones are turned
/// where all around them speak against them.
/// @param hints  of the points
/// @param cell   of the indicator's lattice, world units
[[nodiscard]] GivenSides given_sides(const std::vector<Vec3>& points, const PointHints& hints, const CloudScale& scale,
                                     double cell, const RunContext& run);

/// For each point whether the solid is there and on both of its sides, as where two walls touch or two bodies run into
/// each other: no surface passes there, whatever normals say. Most of the points around it are so, too.
/// @param normals  of either sign, 0 where a point has none: it is never enclosed
/// @param reach    distance from a point at which nothing of it is seen in the indicator, world units
[[nodiscard]] std::vector<char> find_enclosed(const std::vector<Vec3>& points, const std::vector<Vec3>& normals,
                                              const Indicator& indicator, const CloudScale& scale, double reach);

/// Share of the given ones, turned over where all are, that fall in with the orientation's indicator; 0 of none.
[[nodiscard]] double agreeing(const std::vector<Vec3>& points, const std::vector<Vec3>& given,
                              const Orientation& orientation, bool turned_over);

}  // namespace covol::cloud
