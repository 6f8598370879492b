#pragma once
#include <openvdb/openvdb.h>

#include <array>

#include "base/number.h"
#include "covol/domain.h"
#include "covol/fwd.h"

namespace covol::guidance {

/// Trilinear values of a grid at world positions, fast if successive positions lie close together. For one thread.
class GridSampler {
public:
    GridSampler(const FloatGrid& grid, const Domain& domain)
        : accessor_(grid.getConstUnsafeAccessor()), domain_(domain) {}

    [[nodiscard]] double operator()(const Vec3& world) {
        const Vec3 at = domain_.world_to_index(world);
        double part[3];
        openvdb::Coord first;
        bool in_one_leaf = true;
        for (int a = 0; a < 3; ++a) {
            first[a] = detail::round_down(at[a]);
            part[a] = at[a] - first[a];
            in_one_leaf = in_one_leaf && (first[a] & 7) != 7;
        }
        const float* leaf = in_one_leaf ? leaf_at(first) : nullptr;
        if (leaf != nullptr) return between(leaf + Leaf::coordToOffset(first), 64, 8, part);
        float corners[8];
        for (int n = 0; n < 8; ++n) corners[n] = value(first.offsetBy(n >> 2, n >> 1 & 1, n & 1));
        return between(corners, 4, 2, part);
    }

private:
    using Leaf = FloatGrid::TreeType::LeafNodeType;
    struct Cached {
        openvdb::Coord origin = openvdb::Coord::max();
        const float* values = nullptr;
    };

    /// The values of the leaf with this voxel; null if there is none. Each of eight neighbouring leaves has its own
    /// cache entry.
    const float* leaf_at(const openvdb::Coord& voxel) {
        const openvdb::Coord origin = voxel & ~7;
        Cached& cached = cached_[(voxel.x() >> 3 & 1) << 2 | (voxel.y() >> 3 & 1) << 1 | (voxel.z() >> 3 & 1)];
        if (cached.origin != origin) {
            const Leaf* leaf = accessor_.probeConstLeaf(voxel);
            cached = {origin, leaf != nullptr ? leaf->buffer().data() : nullptr};
        }
        return cached.values;
    }
    float value(const openvdb::Coord& voxel) {
        const float* leaf = leaf_at(voxel);
        return leaf != nullptr ? leaf[Leaf::coordToOffset(voxel)] : accessor_.getValue(voxel);
    }
    /// The same arithmetic as openvdb::tools::BoxSampler. @param i, j  strides of the first two axes
    static double between(const float* v, int i, int j, const double part[3]) {
        const auto mix = [](float a, float b, double weight) { return a + float(double(b - a) * weight); };
        const auto along = [&](const float* p) { return mix(p[0], p[1], part[2]); };
        const auto across = [&](const float* p) { return mix(along(p), along(p + j), part[1]); };
        return double(mix(across(v), across(v + i), part[0]));
    }

    FloatGrid::ConstUnsafeAccessor accessor_;  // not registered with the tree: that would take longer than a few reads
    const Domain& domain_;
    std::array<Cached, 8> cached_;
};

}  // namespace covol::guidance
