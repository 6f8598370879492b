#pragma once
#include <vector>

#include "covol/domain.h"
#include "covol/image.h"

namespace covol::guidance {

/// A part of an image, smoothed, for fast interpolation anywhere in it.
class SmoothImage {
public:
    /// @param box    world; what is sampled
    /// @param sigma  Gaussian, world units: along axes whose voxels are longer it hardly smooths
    SmoothImage(const Image& image, const WorldBox& box, double sigma);

    /// False outside the image (half a voxel beyond its last centres).
    bool sample(const Vec3& world, float& value) const;
    [[nodiscard]] bool empty() const noexcept { return values_.empty(); }

private:
    void smooth(int axis, double sigma);

    Matrix3 to_index_{};
    Vec3 offset_{};
    Index3 size_{0, 0, 0};       // of the part
    Vec3 low_{}, high_{};        // of the image, in indices of the part
    std::vector<float> values_;  // i fastest
};

}  // namespace covol::guidance
