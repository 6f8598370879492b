#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "covol/image.h"
#include "covol/run.h"

// An image as slices that a page can hold.
namespace covol::detail {

/// The part of an image that is shown, and how coarsely.
struct SlicePlan {
    VoxelBox region;
    Index3 step{1, 1, 1};  ///< voxels of the image for one that is shown
    Index3 size{0, 0, 0};  ///< voxels that are shown
};
/// At most `most` voxels, as far as three of them are allowed along each axis: all that is held, or where that is too
/// much the voxels around `places`, thinned, the finest axis first.
/// @param places  world units; none: the whole image counts
[[nodiscard]] SlicePlan plan_slices(const ImageGeometry& geometry, const VoxelBox& held,
                                    const std::vector<Vec3>& places, std::int64_t maximum);

/// Slices along k, each a grey JPEG: black and white are the intensities that 0.2 % and 99.8 % of the voxels stay
/// below.
struct CodedSlices {
    ImageGeometry geometry;  ///< of the voxels that are shown
    double black = 0, white = 0;
    std::vector<std::string> jpegs;  ///< base64
};
/// Along i and j voxels are means, along k every n-th slice stands for its neighbours.
/// @throws Error Cancelled; what reading the image throws.
[[nodiscard]] CodedSlices encode_slices(const Image& image, const SlicePlan& plan, int quality, const RunContext& run);

}  // namespace covol::detail
