#pragma once
#include <algorithm>
#include <cmath>

#include "covol/fwd.h"

// Lengths and positions that floating-point numbers represent well, for files of any kind.
namespace covol::detail {

// World units. Their cubes, which are volumes, are still in the range of single precision, in which some volumes are
// stored.
constexpr double kMinLength = 1e-12, kLargestLength = 1e12;
// Maximum distance from 0, in voxels, at which double precision still resolves a millionth of a voxel.
constexpr double kFarthestVoxel = 4294967296.0;

/// Maximum distance from 0 of the origin of an image or a grid with voxels of that size, in world units.
[[nodiscard]] inline double farthest_origin(double voxel_size) {
    return std::min(kLargestLength, kFarthestVoxel * voxel_size);
}

/// Whether every coordinate is a number whose absolute value is at most `farthest`.
[[nodiscard]] inline bool is_within(const Vec3& place, double farthest) {
    return std::all_of(place.begin(), place.end(), [&](double x) { return std::abs(x) <= farthest; });
}

}  // namespace covol::detail
