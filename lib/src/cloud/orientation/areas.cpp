#include "cloud/orientation/areas.h"

#include <cmath>

#include "points/neighbours.h"

namespace covol::cloud {
namespace {

constexpr std::size_t kNeighbours = 8;

}  // namespace

std::vector<double> areas_of(const std::vector<Vec3>& points, double spacing) {
    const PointCells cells(points, kFirstRadius * spacing);
    std::vector<double> areas(points.size());
    for_nearest(cells, spacing, kNeighbours, [&](std::uint32_t point, const std::vector<Neighbour>& near) {
        areas[point] = near.empty() ? spacing * spacing : M_PI * near.back().squared / double(near.size());
    });
    return areas;
}

}  // namespace covol::cloud
