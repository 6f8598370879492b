#pragma once
// The attempts of orient(), for callers that know the size of the cloud's parts.
#include "covol/orientation.h"

namespace covol::cloud {

/// The same as orient(), on the caller's threads.
/// @param part  part_side() of the points, or of the cloud from which they are left
[[nodiscard]] Orientation try_orientations(const std::vector<Vec3>& points, const CloudScale& scale, double part,
                                           const RunContext& run);

}  // namespace covol::cloud
