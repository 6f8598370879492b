#pragma once
// Points that are not on a surface.
#include <vector>

#include "covol/orientation.h"
#include "covol/run.h"

namespace covol::cloud {

/// Whether each point is on no sheet: its neighbours are far away compared with the cloud's median, and either they do
/// not lie in a plane or the point is far from that plane. Points scattered in space are stray; sparse parts of a
/// surface are not.
[[nodiscard]] std::vector<char> find_stray(const std::vector<Vec3>& points, const CloudScale& scale,
                                           const RunContext& run);

}  // namespace covol::cloud
