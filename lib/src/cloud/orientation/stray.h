#pragma once
// Points that are on no surface.
#include <vector>

#include "covol/orientation.h"
#include "covol/run.h"

namespace covol::cloud {

/// Whether each point is on no sheet: those around it are far from it, compared with the cloud's median, and neither
/// lie in a plane nor next to it. Points spread through space are; sparse parts of a surface are not.
[[nodiscard]] std::vector<char> find_stray(const std::vector<Vec3>& points, const CloudScale& scale,
                                           const RunContext& run);

}  // namespace covol::cloud
