#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "covol/image.h"
#include "covol/run.h"

// Encoding of an image as slices for a page.
namespace covol::detail {

/// The part of an image that is shown, and its resolution.
struct SlicePlan {
    VoxelBox region;
    Index3 step{1, 1, 1};  ///< voxels of the image per voxel shown
    Index3 size{0, 0, 0};  ///< voxels that are shown
};
/// Chooses at most `maximum` voxels, unless three along each axis are more: all held voxels, or, if these are too many,
/// those around `places`, which are subsampled along the axis with the smallest spacing first if necessary.
/// @param held    the voxels of the image that can be read, see Image::held()
/// @param places  world units; if there are none, all held voxels are used
[[nodiscard]] SlicePlan plan_slices(const ImageGeometry& geometry, const VoxelBox& held,
                                    const std::vector<Vec3>& places, std::int64_t maximum);

/// Slices along k, each a grey JPEG: black and white are the intensities below which 0.2 % and 99.8 % of the voxels
/// lie.
struct CodedSlices {
    ImageGeometry geometry;  ///< of the voxels that are shown
    double black = 0, white = 0;
    std::vector<std::string> jpegs;  ///< base64
};
/// Voxels are averaged along i and j; along k, only every step[2]-th slice is used.
/// @throws Error Cancelled; whatever reading the image throws.
[[nodiscard]] CodedSlices encode_slices(const Image& image, const SlicePlan& plan, int quality, const RunContext& run);

}  // namespace covol::detail
