#pragma once
#include <cmath>
#include <vector>

#include "base/heuristics.h"
#include "cloud/indicator/heuristics.h"
#include "covol/domain.h"
#include "points/heuristics.h"
#include "points/neighbours.h"

namespace covol::cloud {

/// Area of the surface that each point represents, world units squared, from the area of the disc whose radius is the
/// distance to its eighth neighbour. A density on a lattice would also count points of the opposite side of thin parts.
[[nodiscard]] inline std::vector<double> areas_of(const std::vector<Vec3>& points, double spacing) {
    const PointCells cells(points, kNear.first_radius * spacing);
    std::vector<double> areas(points.size());
    for_nearest(cells, spacing, kCommon.ring, [&](std::uint32_t point, const std::vector<Neighbour>& near) {
        areas[point] = near.empty() ? spacing * spacing : M_PI * near.back().squared / double(near.size());
    });
    return areas;
}

}  // namespace covol::cloud
