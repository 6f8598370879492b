#pragma once
#include <string>
#include <vector>

#include "covol/domain.h"
#include "covol/run.h"

namespace covol::detail {

/// A tube around the points, {d <= reach + voxels * h}, and how much is kept for its voxels.
struct TubeNeed {
    double reach = 0, voxels = 0;
    bool solved = false;  ///< a band within it is solved on
};

/// Refuses a tube that does not fit into run.memory_budget, before memory is taken for it; free where all of the domain
/// fits.
/// @param where  the caller's name, for messages.
/// @throws Error InvalidOptions that says about how much is needed, and with which voxel size it would fit.
void require_tube_memory(const std::vector<Vec3>& points, const Domain& domain, const TubeNeed& need, const char* where,
                         const RunContext& run);

/// The same for the band around a surface of known area.
void require_band_memory(double area, double voxel_size, const char* where, const RunContext& run);

}  // namespace covol::detail
