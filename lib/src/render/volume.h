#pragma once
// Volume rendering of an image: emission and absorption along parallel rays (Max, Optical models for direct volume
// rendering, 1995).
#include <array>
#include <cstdint>
#include <vector>

#include "covol/image.h"
#include "render/surface_view.h"

namespace covol::figure {

/// The image's values between black and white, as bytes; large images are downsampled by averaging.
class Volume {
public:
    /// @throws whatever reading the image throws.
    Volume(const Image& image, const VoxelBox& region, const std::array<double, 2>& window, const RunContext& run);
    /// In [0,1]; at an index of the image, trilinear; 0 outside.
    [[nodiscard]] double at(const Vec3& index) const;
    [[nodiscard]] const ImageGeometry& geometry() const { return geometry_; }

private:
    ImageGeometry geometry_;  // of the downsampled voxels
    std::vector<std::uint8_t> voxels_;
};

/// The view of it behind the plane through the camera's center. Bright voxels hide what is behind them: with a
/// `density` of 1, bright voxels along one side of the volume are nearly opaque.
[[nodiscard]] Layer cast_volume(const Volume& volume, const Camera& camera, double density, bool on_white,
                                const RunContext& run);

}  // namespace covol::figure
