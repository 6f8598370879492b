#pragma once
#include <openvdb/openvdb.h>

#include <cstdint>
#include <optional>

#include "clip/clipped.h"
#include "covol/clip.h"
#include "covol/domain.h"
#include "covol/image.h"

namespace covol::detail {

/// Determines which voxels of an image have their centres in a solid, box by box, from any number of threads.
class Rasterizer {
public:
    /// @param surface  a level set; kept by reference
    Rasterizer(const FloatGrid& surface, const ImageGeometry& geometry);

    /// Sets the voxels of `box` that are inside to `label` and leaves the others unchanged.
    /// @param out  i fastest
    void fill(const VoxelBox& box, std::uint8_t label, std::uint8_t* out) const;

    /// True if all voxels of the box are inside, false if all are outside. Only the tiles of the level set's tree are
    /// examined, not single voxels; none if they do not determine the answer, or if all voxels are inside according to
    /// them but the surface's clip does not contain the whole image.
    [[nodiscard]] std::optional<bool> uniform(const VoxelBox& box) const;

private:
    [[nodiscard]] openvdb::Vec3d to_index(double i, double j, double k) const;
    [[nodiscard]] const FloatGrid& grid() const { return whole_ ? *whole_->distance : surface_; }

    const FloatGrid& surface_;
    const ImageGeometry geometry_;
    const Domain domain_;
    const std::optional<Uncut> whole_;
    const Clip clip_;  // checked for each voxel, if grid() is not cut off by it
    const bool all_within_;
};

}  // namespace covol::detail
