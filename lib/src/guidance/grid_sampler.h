#pragma once
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include <cmath>

#include "covol/domain.h"
#include "covol/fwd.h"

namespace covol::guidance {

/// Trilinear values of a grid at places of the world, fast where one lies near the one before. Of one thread.
class GridSampler {
public:
    GridSampler(const FloatGrid& grid, const Domain& domain)
        : accessor_(grid.getConstUnsafeAccessor()), domain_(domain) {}

    [[nodiscard]] double operator()(const Vec3& world) const {
        const Vec3 at = domain_.world_to_index(world);
        double part[3];
        openvdb::Coord first;
        bool in_one_leaf = true;
        for (int a = 0; a < 3; ++a) {
            first[a] = int(std::floor(at[a]));
            part[a] = at[a] - first[a];
            in_one_leaf = in_one_leaf && (first[a] & 7) != 7;
        }
        const auto* leaf = in_one_leaf ? accessor_.probeConstLeaf(first) : nullptr;
        if (leaf == nullptr)
            return double(openvdb::tools::BoxSampler::sample(accessor_, openvdb::Vec3d(at[0], at[1], at[2])));
        // The same, where no value has to be looked for.
        const float* v = leaf->buffer().data() + leaf->coordToOffset(first);
        const auto between = [](float a, float b, double weight) { return a + float(double(b - a) * weight); };
        const auto along = [&](const float* p) { return between(p[0], p[1], part[2]); };
        const auto across = [&](const float* p) { return between(along(p), along(p + 8), part[1]); };
        return double(between(across(v), across(v + 64), part[0]));
    }

private:
    FloatGrid::ConstUnsafeAccessor accessor_;  // not registered with the tree, which takes longer than a few values
    const Domain& domain_;
};

}  // namespace covol::guidance
