#pragma once
#include "covol/domain.h"
#include "covol/fwd.h"

namespace covol::detail {

/// How far the band of a moving surface reaches from its zero crossings, in voxels: the 3 of the clamp and the two
/// that it may move before the next call.
inline constexpr int kFollowWidth = 5;

/// Re-makes u's band around its zero level set: active become the voxels within kFollowWidth steps of a sign change,
/// inside the domain. Voxels that leave the band are set to +-w by their sign, w = u's background; leaves without an
/// active voxel become tiles of that value; new voxels keep their tile's value.
void follow_surface(FloatGrid& u, const Domain& domain);

}  // namespace covol::detail
