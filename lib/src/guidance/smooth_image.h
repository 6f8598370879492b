#pragma once
#include <vector>

#include "covol/domain.h"
#include "covol/image.h"
#include "covol/run.h"

namespace covol::guidance {

/// A smoothed part of an image, for fast interpolation anywhere in it.
class SmoothImage {
public:
    /// @param box    world; the part that is sampled
    /// @param sigma  standard deviation of the Gaussian, world units; not applied along axes with spacing > sigma / 0.3
    /// @throws Error InvalidOptions if it takes more than run.memory_budget
    SmoothImage(const Image& image, const WorldBox& box, double sigma, const RunContext& run = {});

    /// Equidistant positions on a line, at which the smoothed image is interpolated.
    class Line {
    public:
        /// Returns false outside the image, which ends half a voxel beyond its last voxel centres.
        bool sample(int step, float& value) const {
            return image_->at({first_[0] + step * step_[0], first_[1] + step * step_[1], first_[2] + step * step_[2]},
                              value);
        }

    private:
        friend SmoothImage;
        const SmoothImage* image_ = nullptr;
        Vec3 first_{}, step_{};  // in voxels of the part
    };
    /// @param step  world units
    [[nodiscard]] Line along(const Vec3& first, const Vec3& step) const;
    [[nodiscard]] bool empty() const noexcept { return values_.empty(); }

private:
    void smooth(int axis, double sigma);
    bool at(const Vec3& index, float& value) const;

    Matrix3 to_index_{};
    Vec3 offset_{};
    Index3 size_{0, 0, 0};       // number of voxels of the part along each axis
    Vec3 low_{}, high_{};        // ends of the image, in voxels of the part, whose first voxel is 0
    std::vector<float> values_;  // of the part's voxels, i fastest
};

}  // namespace covol::guidance
