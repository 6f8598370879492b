#pragma once
#include <vector>

#include "covol/image.h"

// The levels of a pyramid. Along each axis, a level has half as many voxels as the previous (finer) level, or the same
// number.
namespace covol::detail {

struct PyramidLevel {
    Index3 size;
    /// Number of voxels of the previous level for one voxel of this level: 1 or 2 along each axis.
    Index3 factor{1, 1, 1};
    Index3 scale{1, 1, 1};  ///< number of voxels of the finest level for one voxel of this level, along each axis
};

/// The levels from the image down to one chunk. In each level, an axis is not halved if its spacing is at least twice
/// the minimum spacing of the axes that are longer than a chunk, so that the voxels become more isotropic.
/// @param chunk  voxels of a chunk, the same in all levels
[[nodiscard]] std::vector<PyramidLevel> pyramid_levels(const ImageGeometry& geometry, const Index3& chunk);

/// The box of the finest level that corresponds to a box of this level. @param finest  size of the finest level
[[nodiscard]] VoxelBox finest_box(const PyramidLevel& level, const VoxelBox& box, const Index3& finest);

/// Combines boxes of `factor` fine voxels into one voxel each: the most frequent value (if several are equally
/// frequent, the first of them), or the mean.
/// @param fine    the fine voxels, of `fine_size`, i fastest
/// @param coarse  the result, a lattice of `coarse_size`
/// @param first   position in `coarse` of the voxel into which the first fine voxels are combined
void coarsen(PixelType type, bool most_frequent, const Index3& factor, const void* fine, const Index3& fine_size,
             void* coarse, const Index3& first, const Index3& coarse_size);

}  // namespace covol::detail
