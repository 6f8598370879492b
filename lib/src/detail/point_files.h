#pragma once
#include <string>
#include <vector>

#include "covol/points.h"

namespace covol::detail {

/// What a point file says: coordinates in the file's own order.
struct PointTable {
    std::vector<Vec3> points;
    PointSpace space = PointSpace::Unstated;
    PointOrder order = PointOrder::Unstated;
    std::string rule;  ///< which columns or elements, for people
};

/// Reads XYZ, CSV, TSV, PLY, OBJ or OFF by the name's end. @throws as read_points(), which it serves.
PointTable read_point_table(const std::string& path);

}  // namespace covol::detail
