#pragma once
// Volume rendering of an image: emission and absorption along parallel rays (Max, Optical models for direct volume
// rendering, 1995).
#include <array>
#include <cstdint>
#include <vector>

#include "covol/image.h"
#include "render/surface_view.h"

namespace covol::figure {

/// The image's values as bytes, from 0 for black to 255 for white; large images are downsampled by averaging.
class Volume {
public:
    /// @throws whatever reading the image throws.
    Volume(const Image& image, const VoxelBox& region, const std::array<double, 2>& window, const RunContext& run);
    /// The trilinearly interpolated value in [0,1] at an index of geometry(); 0 outside.
    [[nodiscard]] double at(const Vec3& index) const;
    [[nodiscard]] const ImageGeometry& geometry() const { return geometry_; }

private:
    ImageGeometry geometry_;  // of the downsampled voxels
    std::vector<std::uint8_t> voxels_;
};

/// The view of the part of the volume behind the plane through the camera's center. Bright voxels hide what is behind
/// them: with a `density` of 1, white voxels along the shortest side of the volume are nearly opaque.
[[nodiscard]] Layer cast_volume(const Volume& volume, const Camera& camera, double density, bool on_white,
                                const RunContext& run);

}  // namespace covol::figure
