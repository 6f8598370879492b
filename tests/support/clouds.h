#pragma once
#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "covol/domain.h"

// Point clouds for tests, and properties of grids.
namespace covol::test {

/// Random points on a sphere.
inline std::vector<Vec3> sphere_cloud(int count, double radius, unsigned seed, const Vec3& center = {0, 0, 0}) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::vector<Vec3> points(count);
    for (Vec3& p : points) {
        const Vec3 v{normal(random), normal(random), normal(random)};
        const double length = std::hypot(v[0], v[1], v[2]);
        for (int a = 0; a < 3; ++a) p[a] = center[a] + radius * v[a] / length;
    }
    return points;
}

inline std::vector<Vec3> box_cloud(int count, const WorldBox& box, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<Vec3> points(count);
    for (Vec3& p : points)
        for (int a = 0; a < 3; ++a) p[a] = std::uniform_real_distribution<double>(box.min[a], box.max[a])(random);
    return points;
}

inline double brute_force_distance(const std::vector<Vec3>& points, const Vec3& x) {
    double squared = std::numeric_limits<double>::max();
    for (const Vec3& p : points) {
        const double dx = p[0] - x[0], dy = p[1] - x[1], dz = p[2] - x[2];
        squared = std::min(squared, dx * dx + dy * dy + dz * dz);
    }
    return std::sqrt(squared);
}

inline Vec3 world_of(const Domain& domain, const openvdb::Coord& c) {
    return domain.index_to_world({double(c.x()), double(c.y()), double(c.z())});
}

inline float value_at(const FloatGrid& grid, const Vec3& world) {
    const Vec3 at = domain_of(grid).world_to_index(world);
    return grid.tree().getValue({int(std::lround(at[0])), int(std::lround(at[1])), int(std::lround(at[2]))});
}

/// Whether two grids have the same topology, and bitwise equal values in their leaves.
inline bool identical(const FloatGrid& a, const FloatGrid& b) {
    if (!a.tree().hasSameTopology(b.tree())) return false;
    auto other = b.tree().cbeginLeaf();
    for (auto leaf = a.tree().cbeginLeaf(); leaf; ++leaf, ++other)
        if (std::memcmp(leaf->buffer().data(), other->buffer().data(), 512 * sizeof(float)) != 0) return false;
    return true;
}

/// The volume of the voxels with a value below 0, including tiles, in cubed world units.
inline double negative_volume(const FloatGrid& grid) {
    double n = 0;
    for (auto value = grid.tree().cbeginValueAll(); value; ++value)
        if (*value < 0) n += double(value.getVoxelCount());
    return n * std::pow(grid.voxelSize()[0], 3);
}

}  // namespace covol::test
