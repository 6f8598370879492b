#pragma once
#include <deque>
#include <functional>
#include <vector>

#include "covol/run.h"
#include "grid/leaf_band.h"

namespace covol::detail {

/// The nearest known point of each voxel of a leaf; -1: none known.
struct NearestLeaf {
    Coord origin;
    std::array<std::int32_t, 27> neighbours;  // -1: no such leaf
    std::array<std::int32_t, kLeafSize> nearest;
    std::uint32_t affected = 0;  // neighbours that this leaf's last change affects: bits by neighbour_slot()
    bool queued = false;
    bool visited = false;
};

/// The voxels around a set of points, each with the index of its nearest point.
struct NearestField {
    std::vector<Vec3> points;          ///< index space, sorted by leaf
    std::vector<std::int32_t> source;  ///< index of points[n] in the input
    std::deque<NearestLeaf> leaves;
    int rounds = 0;
};

/// Finds the nearest point of each voxel within `radius` voxels of the points and within `box`, by sweeps in which a
/// voxel takes the point of a neighbour if that is nearer than its own.
///
/// Every leaf that the tube meets is included; voxels farther away than `radius` may have a point that is not the
/// nearest. Leaves whose indices have equal parities along all three axes are swept in parallel, since none of them
/// reads another. A leaf is swept again if a neighbour has changed the voxels next to it.
/// @param points  index space, finite. Points outside `box` count: the tube is followed outside of it if necessary.
/// @param where   the caller's name, for messages.
/// @param enters  whether a leaf, given by its origin, is included; null: all are
/// @throws Error InvalidInput if the box is longer than 2^24 voxels; Cancelled.
[[nodiscard]] NearestField nearest_points(const std::vector<Vec3>& points, const CoordBBox& box, double radius,
                                          const char* where, const RunContext& run,
                                          const std::function<bool(const Coord&)>& enters = nullptr);

/// Squared distances, in voxels, of a leaf's voxels from their points; very large if a voxel has none.
void squared_distances(const NearestField& field, const NearestLeaf& leaf, float* squared);

}  // namespace covol::detail
