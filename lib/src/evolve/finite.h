#pragma once
#include <openvdb/Types.h>

#include "covol/error.h"
#include "covol/fwd.h"

namespace covol::detail {

/// The error InvalidInput with the message "evolve: u: expected finite values, got nan at voxel (1, 2, 3)".
[[nodiscard]] Error not_finite(const char* what, float value, const openvdb::Coord& at);

/// Checks the active voxels. @throws Error InvalidInput, with the first value that is not finite.
void expect_finite(const FloatGrid& grid, const char* what);

}  // namespace covol::detail
