#pragma once
#include <cmath>
#include <vector>

#include "base/heuristics.h"
#include "cloud/indicator/heuristics.h"
#include "covol/domain.h"
#include "points/heuristics.h"
#include "points/neighbours.h"

namespace covol::cloud {

/// Area of the surface that each point represents, world units squared: an eighth of the area of the disc whose radius
/// is the distance to its eighth neighbour. It is not computed from the number of points in the cells of a lattice,
/// because the cells of a thin part also contain points of its opposite side.
[[nodiscard]] inline std::vector<double> areas_of(const std::vector<Vec3>& points, double spacing) {
    const PointCells cells(points, kNear.first_radius * spacing);
    std::vector<double> areas(points.size());
    for_nearest(cells, spacing, kCommon.ring, [&](std::uint32_t point, const std::vector<Neighbour>& near) {
        areas[point] = near.empty() ? spacing * spacing : M_PI * near.back().squared / double(near.size());
    });
    return areas;
}

}  // namespace covol::cloud
