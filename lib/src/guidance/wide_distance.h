#pragma once
#include <vector>

#include "covol/domain.h"
#include "covol/run.h"
#include "distance/nearest.h"

namespace covol::guidance {

/// The signed distance to a surface in a wide band: its own in the surface's band, beyond it that to the nearest
/// vertex.
class WideDistance {
public:
    /// @param start     a signed distance in a band of kHalfWidthVoxels, negative inside
    /// @param vertices  world; of its mesh, about a voxel apart
    /// @param width     of the band to either side, voxels
    WideDistance(const FloatGrid& start, const std::vector<Vec3>& vertices, const Domain& domain, double width,
                 const RunContext& run);

    [[nodiscard]] const FloatGridPtr& grid() const { return grid_; }
    /// Less what is given for the nearest vertex: negative where the surface is once each part has moved that far
    /// outward.
    [[nodiscard]] FloatGridPtr less(const std::vector<double>& by_vertex) const;

private:
    detail::NearestField nearest_;
    FloatGridPtr grid_;
};

}  // namespace covol::guidance
