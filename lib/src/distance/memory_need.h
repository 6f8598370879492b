#pragma once
#include <string>
#include <vector>

#include "covol/domain.h"
#include "covol/run.h"

namespace covol::detail {

/// A tube around the points, {d <= reach + voxels * h}, and what is stored for its voxels.
struct TubeNeed {
    double reach = 0, voxels = 0;
    bool solved = false;  ///< a flow is solved on a band within it
};

/// Rejects a tube that does not fit into run.memory_budget before memory is allocated for it; costs nothing if the
/// whole domain fits.
/// @param where  the caller's name, for messages.
/// @throws Error InvalidOptions with the approximate memory needed and a voxel size that would fit.
void require_tube_memory(const std::vector<Vec3>& points, const Domain& domain, const TubeNeed& need, const char* where,
                         const RunContext& run);

/// The same for the band around a surface of known area.
void require_band_memory(double area, double voxel_size, const char* where, const RunContext& run);

}  // namespace covol::detail
