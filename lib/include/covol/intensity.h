#pragma once
#include <cstdint>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/run.h"

namespace covol {

/// Statistics of the voxels whose centres lie inside a surface.
struct IntensityStatistics {
    std::uint64_t voxels = 0;
    double mean = 0, standard_deviation = 0;  ///< of the image's values; 0 without voxels
};

/// The number of the image's voxels in the bounding box of a surface.
[[nodiscard]] COVOL_API double count_voxels_around(const Image& image, const FloatGrid& surface);

/// @param surface  a level set, negative inside
/// @throws Error Cancelled; for an image in chunks as Image::load().
[[nodiscard]] COVOL_API IntensityStatistics measure_intensity(const Image& image, const FloatGrid& surface,
                                                              const RunContext& run = {});

}  // namespace covol
