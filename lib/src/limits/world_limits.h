#pragma once
#include <algorithm>
#include <cmath>

#include "covol/fwd.h"

// Lengths and places that numbers hold well, whatever file they come from.
namespace covol::detail {

// Volumes are cubes of lengths, and some are held in single precision.
constexpr double kMinLength = 1e-12, kLargestLength = 1e12;
// From 0: double precision then has a million places within a voxel.
constexpr double kFarthestVoxel = 4294967296.0;

/// How far from 0 an image or a grid with voxels of that size may begin, in world units.
[[nodiscard]] inline double farthest_origin(double voxel_size) {
    return std::min(kLargestLength, kFarthestVoxel * voxel_size);
}

/// Whether every coordinate is a number within `farthest` of 0.
[[nodiscard]] inline bool is_within(const Vec3& place, double farthest) {
    return std::all_of(place.begin(), place.end(), [&](double x) { return std::abs(x) <= farthest; });
}

}  // namespace covol::detail
