#pragma once
#include <cstddef>
#include <limits>

#include "covol/domain.h"
#include "covol/run.h"

namespace covol::cloud {

/// Gives `target` the topology of `rough`, a level set on the same lattice: starting from rough's sign, each voxel
/// takes target's if that preserves all pieces, cavities and handles (simple points: Bertrand and Malandain, A new
/// characterization of three-dimensional simple points, Pattern Recognition Letters 15, 1994; Han, Xu and Prince, A
/// topology preserving level set method, IEEE PAMI 25, 2003). Inside is 6-connected, outside 18-connected, as
/// extract_mesh() joins voxels. The voxels deepest in target change first, so that cuts and fillings are at the
/// narrowest places. Both level sets are active near their surface and signed everywhere.
/// @param maximum  number of voxels whose signs may differ, which limits the time; if there are more, nothing is
/// changed
/// @return the number of voxels that keep rough's sign; their value is small
/// @throws Error Cancelled
std::size_t hold_topology(const FloatGrid& rough, FloatGrid& target, const RunContext& run,
                          std::size_t maximum = std::numeric_limits<std::size_t>::max());

}  // namespace covol::cloud
