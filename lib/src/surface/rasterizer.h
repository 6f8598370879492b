#pragma once
#include <openvdb/openvdb.h>

#include <cstdint>
#include <optional>

#include "clip/clipped.h"
#include "covol/clip.h"
#include "covol/domain.h"
#include "covol/image.h"

namespace covol::detail {

/// Which voxels of an image have their centres in a solid; a box at a time, by any number of threads.
class Rasterizer {
public:
    /// @param surface  a level set; kept by reference
    Rasterizer(const FloatGrid& surface, const ImageGeometry& geometry);

    /// Sets the voxels of `box` that are inside to `label` and leaves the others as they are.
    /// @param out  i fastest
    void fill(const VoxelBox& box, std::uint8_t label, std::uint8_t* out) const;

    /// Whether all voxels of the box are inside, or all outside, where the tree's tiles say so; none: look at each.
    [[nodiscard]] std::optional<bool> uniform(const VoxelBox& box) const;

private:
    [[nodiscard]] openvdb::Vec3d to_index(double i, double j, double k) const;
    [[nodiscard]] const FloatGrid& grid() const { return whole_ ? *whole_->distance : surface_; }

    const FloatGrid& surface_;
    const ImageGeometry geometry_;
    const Domain domain_;
    const std::optional<Uncut> whole_;
    const Clip clip_;  // to be looked at beside the grid
    const bool all_within_;
};

}  // namespace covol::detail
