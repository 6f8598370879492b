#pragma once
#include <vector>

#include "covol/image.h"

namespace covol::tool {

/// The image's values on isotropic voxels of edge h, as a fog volume "density"; voxels outside the image are inactive.
[[nodiscard]] FloatGridPtr to_grid(const Image& image, double h, const RunContext& run);
/// Memory, bytes, that to_grid() needs for an image with this geometry and for voxels of edge h.
[[nodiscard]] double bytes_of_grid(const ImageGeometry& geometry, double h);

/// The lattice of the grid as an image geometry, limited to the bounding box of its active voxels.
/// @throws Error InvalidInput if it has none.
[[nodiscard]] ImageGeometry geometry_of(const FloatGrid& grid);

/// Trilinear samples of the grid at the voxel centres of `geometry`, i fastest.
[[nodiscard]] std::vector<float> sample(const FloatGrid& grid, const ImageGeometry& geometry, const RunContext& run);

}  // namespace covol::tool
