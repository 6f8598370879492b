#pragma once
#include <vector>

#include "covol/evidence.h"
#include "covol/pipeline.h"

namespace covol::tool {

/// Judges a result by its marks and the image's edges. The marks reach as far as the points' attraction does, or
/// 5 voxels where that is unlimited.
/// @param suggestions  how many slices to name
[[nodiscard]] Evidence judge(const SegmentResult& result, const std::vector<Vec3>& marks, const Image& image,
                             int suggestions, const RunContext& run);

}  // namespace covol::tool
