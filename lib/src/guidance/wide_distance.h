#pragma once
#include <vector>

#include "covol/domain.h"
#include "covol/run.h"
#include "distance/nearest.h"

namespace covol::guidance {

/// The signed distance to a surface in a wide band. Within the narrow band of the start these are the start's own
/// values; beyond it, the distance to the nearest vertex of the mesh.
class WideDistance {
public:
    /// @param start     a signed distance in a band of kHalfWidthVoxels, negative inside
    /// @param vertices  of the mesh that was extracted from `start`, world units, about a voxel apart
    /// @param width     of the wide band on each side of the surface, voxels
    WideDistance(const FloatGrid& start, const std::vector<Vec3>& vertices, const Domain& domain, double width,
                 const RunContext& run);

    [[nodiscard]] const FloatGridPtr& grid() const { return grid_; }
    /// The distance minus the given value of the nearest vertex: its zero level set is the surface after each part has
    /// moved outward by that value.
    [[nodiscard]] FloatGridPtr less(const std::vector<double>& by_vertex) const;

private:
    detail::NearestField nearest_;
    FloatGridPtr grid_;
};

}  // namespace covol::guidance
