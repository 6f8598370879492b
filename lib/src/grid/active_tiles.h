#pragma once
#include <openvdb/openvdb.h>

#include <string>

#include "covol/fwd.h"
#include "limits/memory_budget.h"

namespace covol::detail {

/// Checks the memory that the active tiles of a grid need after their conversion to leaves: a tile of a few bytes
/// represents up to 4096^3 voxels.
/// @param where  the caller's name @throws Error InvalidOptions
inline void require_memory_of_tiles(const FloatGrid& grid, const char* where, const RunContext& run) {
    const double voxels = double(grid.activeVoxelCount()) - double(grid.tree().activeLeafVoxelCount());
    require_memory(sizeof(float) * voxels,
                   std::string(where) + ": grid '" + grid.getName() + "': a band with the voxels of its active tiles",
                   "expected a narrow band", run);
}

}  // namespace covol::detail
