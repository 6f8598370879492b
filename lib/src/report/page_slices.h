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
/// At most `maximum` voxels, if three along each axis allow it: all that are held, or, if these are too many, the
/// voxels around `places`, subsampled along the finest axis first.
/// @param places  world units; none: the whole image is used
[[nodiscard]] SlicePlan plan_slices(const ImageGeometry& geometry, const VoxelBox& held,
                                    const std::vector<Vec3>& places, std::int64_t maximum);

/// Slices along k, each a grey JPEG: black and white are the intensities below which 0.2 % and 99.8 % of the voxels
/// lie.
struct CodedSlices {
    ImageGeometry geometry;  ///< of the voxels that are shown
    double black = 0, white = 0;
    std::vector<std::string> jpegs;  ///< base64
};
/// Along i and j voxels are averaged, along k every n-th slice represents its neighbours.
/// @throws Error Cancelled; whatever reading the image throws.
[[nodiscard]] CodedSlices encode_slices(const Image& image, const SlicePlan& plan, int quality, const RunContext& run);

}  // namespace covol::detail
