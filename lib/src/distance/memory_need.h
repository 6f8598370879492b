#pragma once
#include <string>
#include <vector>

#include "covol/domain.h"
#include "covol/run.h"

namespace covol::detail {

/// A tube around the points, {d <= reach + voxels * h}, where d is the distance to the points and h the voxel size, and
/// what is stored for its voxels.
struct TubeNeed {
    double reach = 0, voxels = 0;
    bool solved = false;  ///< a flow is solved on a band within it
};

/// Rejects a tube that does not fit into run.memory_budget before memory is allocated for it. If the whole domain
/// fits, nothing is computed.
/// @param where  the caller's name, for messages.
/// @throws Error InvalidOptions with the approximate memory needed and a voxel size that would fit.
void require_tube_memory(const std::vector<Vec3>& points, const Domain& domain, const TubeNeed& need, const char* where,
                         const RunContext& run);

/// Rejects the narrow band around a surface of the given area, world units squared, if it does not fit into
/// run.memory_budget.
void require_band_memory(double area, double voxel_size, const char* where, const RunContext& run);

}  // namespace covol::detail
