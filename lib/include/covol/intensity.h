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

/// Measures the image inside a surface. Only a few slices of the image are read at a time.
/// @param surface  a level set, negative inside
/// @throws Error Cancelled; also as for Image::load(), if the image is in chunks.
[[nodiscard]] COVOL_API IntensityStatistics measure_intensity(const Image& image, const FloatGrid& surface,
                                                              const RunContext& run = {});

}  // namespace covol
