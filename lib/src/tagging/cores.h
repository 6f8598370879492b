#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include "covol/domain.h"
#include "covol/fwd.h"

namespace covol::detail {

/// A component of {d > D}, where d is the distance to the points, that is connected to the exterior only for smaller D.
/// Lengths are in voxels.
struct Core {
    double saddle = 0;  ///< D below which it is connected to the exterior: half width of its widest gap
    double peak = 0;    ///< maximum of d in it
    double volume = 0, area = 0;

    /// Factor by which the core's lengths grow if it is dilated by its saddle, as for a ball of that area per volume.
    [[nodiscard]] double growth() const { return 1.0 + saddle * area / (3.0 * volume); }
    [[nodiscard]] double full_volume() const { return volume * std::pow(growth(), 3); }
    [[nodiscard]] double full_area() const { return area * std::pow(growth(), 2); }
};

/// The regions that a cloud encloses, for all tag distances.
struct Cores {
    std::vector<Core> cores;              ///< by decreasing saddle
    std::vector<std::int64_t> histogram;  ///< voxels of the tube by d, in buckets of 1 / kBucketsPerVoxel voxels
    std::int64_t tube_voxels = 0;

    /// Volume of {d <= distance}, both in voxels.
    [[nodiscard]] double cloud_volume(double distance) const;
};

/// 0-dimensional persistence of the superlevel sets {d > D} (Edelsbrunner and Harer, "Computational Topology", 2010,
/// chapter VII). As D decreases, components are born at peaks of d and merge at saddles. One of them, the exterior,
/// exists from the start; each other one is a core until it merges with the exterior, when D falls
/// below d at the saddle in its widest gap.
///
/// Each voxel belongs to the peak found by steepest ascent, computed for all voxels in parallel; only the saddles
/// between the regions of peaks are processed in order of d.
/// @param distance  d within a tube around the points, its background beyond; @pre at least one leaf
/// @param radius  of the tube, world units; d beyond it counts as this
/// @param seeds  world; a component that contains one is exterior
[[nodiscard]] Cores find_cores(const FloatGrid& distance, double radius, const std::vector<Vec3>& seeds);

}  // namespace covol::detail
