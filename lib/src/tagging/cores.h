#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include "covol/domain.h"
#include "covol/fwd.h"

namespace covol::detail {

/// A component of {d > D} that does not reach the exterior, at the largest D at which it would. Lengths in voxels.
struct Core {
    double saddle = 0;  ///< that D: radius of its largest gap
    double peak = 0;    ///< largest d in it
    double volume = 0, area = 0;

    /// The core grown by its saddle, as a ball of the same area per volume would grow.
    [[nodiscard]] double growth() const { return 1.0 + saddle * area / (3.0 * volume); }
    [[nodiscard]] double full_volume() const { return volume * std::pow(growth(), 3); }
    [[nodiscard]] double full_area() const { return area * std::pow(growth(), 2); }
};

/// What a cloud encloses, at any tag distance.
struct Cores {
    std::vector<Core> cores;              ///< by falling saddle
    std::vector<std::int64_t> histogram;  ///< voxels of the tube by d, in buckets of buckets_per_voxel
    std::int64_t tube_voxels = 0;

    /// Of {d <= distance}, both in voxels.
    [[nodiscard]] double cloud_volume(double distance) const;
};

/// 0-dimensional persistence of the superlevel sets {d > D} (Edelsbrunner and Harer, "Computational Topology", 2010,
/// chapter VII). As D falls, components are born at peaks of d and merge at saddles. One of them, the exterior, is
/// there from the start; each other one is a core until it merges with the exterior: there its last gap opens.
///
/// Voxels belong to the peak that steepest ascent finds, all of them at once; what is in order of d are only the
/// saddles between those.
/// @param distance  d within a tube, its background beyond; @pre at least one leaf
/// @param radius  of the tube, world units: d of all that lies beyond it
/// @param seeds  world; what holds one is exterior
[[nodiscard]] Cores find_cores(const FloatGrid& distance, double radius, const std::vector<Vec3>& seeds);

}  // namespace covol::detail
