#include "meshing/level_set_distance.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <limits>

#include "covol/error.h"
#include "covol/surface.h"
#include "meshing/mesh_distance.h"
#include "points/kd_tree.h"

namespace covol::detail {
namespace {

/// Where edges of the lattice cut the surface.
std::vector<Vec3> crossings_of(const FloatGrid& surface) {
    std::vector<Vec3> crossings;
    const auto at = surface.getConstAccessor();
    for (auto value = surface.cbeginValueOn(); value; ++value) {
        const double here = double(*value);
        if (std::abs(here) > 2 * surface.voxelSize()[0]) continue;
        for (int axis = 0; axis < 3; ++axis) {
            openvdb::Coord next = value.getCoord();
            ++next[axis];
            const double there = double(at.getValue(next));
            if ((here < 0) == (there < 0)) continue;
            openvdb::Vec3d index = value.getCoord().asVec3d();
            index[axis] += here / (here - there);
            const openvdb::Vec3d world = surface.indexToWorld(index);
            crossings.push_back({world[0], world[1], world[2]});
        }
    }
    return crossings;
}

}  // namespace

std::vector<double> distances_to(const FloatGrid& surface, const std::vector<Vec3>& points) {
    using Range = tbb::blocked_range<std::size_t>;
    // Within a voxel of the band's end corners of a point's cell lie beyond it, where values are cut.
    const double limit = double(surface.background()) - surface.voxelSize()[0];
    std::vector<double> distances(points.size());
    std::vector<char> is_far(points.size());
    tbb::parallel_for(Range(0, points.size(), 1024), [&](const Range& range) {
        const auto at = surface.getConstAccessor();
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const openvdb::Vec3d world(points[n][0], points[n][1], points[n][2]);
            const double value = openvdb::tools::BoxSampler::sample(at, surface.worldToIndex(world));
            is_far[n] = !(std::abs(value) < limit);
            distances[n] = is_far[n] ? std::numeric_limits<double>::infinity() : std::abs(value);
        }
    });
    std::vector<std::size_t> far;
    for (std::size_t n = 0; n < points.size(); ++n)
        if (is_far[n]) far.push_back(n);
    if (far.empty()) return distances;
    const KdTree crossings(crossings_of(surface));
    tbb::parallel_for(Range(0, far.size(), 64), [&](const Range& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n)
            distances[far[n]] = std::sqrt(crossings.nearest(points[far[n]]));
    });
    return distances;
}

}  // namespace covol::detail

namespace covol {

FitStatistics measure_fit(const std::vector<Vec3>& points, const FloatGrid& surface, const RunContext& run) {
    if (points.empty()) throw Error(Errc::InvalidInput, "measure_fit: expected at least one point, got none");
    std::vector<double> distances;
    with_threads(run, [&] { distances = detail::distances_to(surface, points); });
    return detail::statistics_of(std::move(distances));
}

}  // namespace covol
