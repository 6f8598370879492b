#pragma once
#include <openvdb/Types.h>

#include "covol/error.h"
#include "covol/fwd.h"

namespace covol::detail {

/// InvalidInput: "evolve: u: expected finite values, got nan at voxel (1, 2, 3)".
[[nodiscard]] Error not_finite(const char* what, float value, const openvdb::Coord& at);

/// Checks the active voxels; the message contains the first that is not finite. @throws Error InvalidInput.
void expect_finite(const FloatGrid& grid, const char* what);

}  // namespace covol::detail
