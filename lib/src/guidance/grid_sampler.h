#pragma once
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

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
        return double(openvdb::tools::BoxSampler::sample(accessor_, openvdb::Vec3d(at[0], at[1], at[2])));
    }

private:
    FloatGrid::ConstUnsafeAccessor accessor_;  // not registered with the tree, which takes longer than a few values
    const Domain& domain_;
};

}  // namespace covol::guidance
