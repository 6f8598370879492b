#include "meshing/level_set_distance.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "covol/error.h"
#include "covol/surface.h"
#include "grid/sign_masks.h"
#include "meshing/mesh_distance.h"
#include "points/kd_tree.h"

namespace covol::detail {
namespace {

// Up to this number, testing every leaf for each point is faster than a tree of all crossings.
constexpr std::size_t kFewPoints = 2048;

using Leaf = FloatGrid::TreeType::LeafNodeType;

/// Appends the crossings of the surface with the lattice's edges that start at active voxels of this leaf whose value
/// (distance) is at most `limit`, in world units.
void add_crossings(const FloatGrid& surface, const Leaf& leaf, double limit, std::vector<Vec3>& crossings) {
    const auto at = surface.getConstAccessor();
    for (auto value = leaf.cbeginValueOn(); value; ++value) {
        const double here = double(*value);
        if (std::abs(here) > limit) continue;
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
}

/// Whether add_crossings() finds a crossing on an edge between two voxels of the leaf.
bool has_crossing(const Leaf& leaf, double limit) {
    const float* values = leaf.buffer().data();
    const LeafMask negative = negative_mask(values);
    for (int axis = 0; axis < 3; ++axis) {
        const LeafMask changes = sign_changes(negative, axis);
        for (int word = 0; word < 8; ++word)
            for (std::uint64_t bits = changes[word]; bits != 0; bits &= bits - 1) {
                const int at = word << 6 | __builtin_ctzll(bits);
                if (leaf.isValueOn(openvdb::Index(at)) && !(std::abs(double(values[at])) > limit)) return true;
            }
    }
    return false;
}

/// Squared distances, in voxels, from a position to the nearest and the farthest point of the box that contains the
/// lattice's edges that start in a leaf.
struct LeafReach {
    double nearest = 0, farthest = 0;
    LeafReach(const openvdb::Vec3d& at, const openvdb::Coord& origin) {
        for (int a = 0; a < 3; ++a) {
            const double below = origin[a] - at[a], above = at[a] - (origin[a] + kLeafDim);
            nearest += std::pow(std::max({below, above, 0.0}), 2);
            farthest += std::pow(std::max(-below, -above), 2);
        }
    }
};

/// A set of crossings that contains, for each point, the crossing nearest to it.
std::vector<Vec3> crossings_near(const FloatGrid& surface, const std::vector<Vec3>& points) {
    const double limit = 2 * surface.voxelSize()[0];
    std::vector<const Leaf*> leaves;
    surface.tree().getNodes(leaves);
    std::vector<char> is_wanted(leaves.size(), 1);
    if (points.size() <= kFewPoints) {
        std::vector<char> is_cut(leaves.size());
        tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t n) {
            is_cut[n] = has_crossing(*leaves[n], limit);
            is_wanted[n] = 0;
        });
        tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t p) {
            const openvdb::Vec3d at = surface.worldToIndex(openvdb::Vec3d(points[p][0], points[p][1], points[p][2]));
            double bound = std::numeric_limits<double>::infinity();
            for (std::size_t n = 0; n < leaves.size(); ++n)
                if (is_cut[n]) bound = std::min(bound, LeafReach(at, leaves[n]->origin()).farthest);
            for (std::size_t n = 0; n < leaves.size(); ++n)
                if (LeafReach(at, leaves[n]->origin()).nearest <= bound)
                    std::atomic_ref(is_wanted[n]).store(1, std::memory_order_relaxed);
        });
    }
    std::vector<Vec3> crossings;
    for (std::size_t n = 0; n < leaves.size(); ++n)
        if (is_wanted[n]) add_crossings(surface, *leaves[n], limit, crossings);
    return crossings;
}

}  // namespace

std::vector<double> distances_to(const FloatGrid& surface, const std::vector<Vec3>& points) {
    using Range = tbb::blocked_range<std::size_t>;
    // Within a voxel of the band's end, corners of a point's cell may lie outside the band, where values are clamped,
    // so that the interpolated value would be wrong.
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
    std::vector<Vec3> places;
    for (const std::size_t n : far) places.push_back(points[n]);
    const KdTree crossings(crossings_near(surface, places));
    tbb::parallel_for(Range(0, far.size(), 64), [&](const Range& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n)
            distances[far[n]] = std::sqrt(crossings.nearest(points[far[n]]));
    });
    return distances;
}

}  // namespace covol::detail

namespace covol {

FitStatistics measure_fit(const std::vector<Vec3>& points, const FloatGrid& surface, const RunContext& run) {
    if (points.empty()) throw Error(Errc::InvalidInput, "points: expected at least one, got none");
    std::vector<double> distances;
    with_threads(run, [&] { distances = detail::distances_to(surface, points); });
    return detail::statistics_of(std::move(distances));
}

}  // namespace covol
