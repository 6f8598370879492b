#pragma once
#include <vector>

#include "covol/image.h"

// The levels of a pyramid, each of half the size of the one before.
namespace covol::detail {

struct PyramidLevel {
    Index3 size;
    Index3 factor{1, 1, 1};  ///< voxels of the level before that one of this level stands for: 1 or 2 along each axis
    Index3 scale{1, 1, 1};   ///< the same, of the finest level
};

/// From the image down to one chunk. An axis whose spacing is twice that of the finest of those that do not fit into a
/// chunk yet, or more, waits until it is not.
/// @param chunk  voxels of a chunk, the same in all levels
[[nodiscard]] std::vector<PyramidLevel> pyramid_levels(const ImageGeometry& geometry, const Index3& chunk);

/// The box of the finest level that a box of this level stands for.
[[nodiscard]] VoxelBox finest_box(const PyramidLevel& level, const VoxelBox& box, const Index3& finest);

/// Makes the voxels of `factor` fine ones each: the most frequent value (of equally frequent ones that of the first
/// voxel), or the mean.
/// @param fine    the fine voxels, of `fine_size`, i fastest
/// @param coarse  where the first one goes, in a lattice of `coarse_size`
void coarsen(PixelType type, bool most_frequent, const Index3& factor, const void* fine, const Index3& fine_size,
             void* coarse, const Index3& first, const Index3& coarse_size);

}  // namespace covol::detail
