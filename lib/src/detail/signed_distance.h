#pragma once
#include "detail/leaf_columns.h"

namespace covol::detail {

/// Signed distance, in voxels and clamped to [-width, width], to the interface between voxels of phi < 0 and phi >= 0.
///
/// Beside the interface phi tells where between two voxels it lies; its scale does not matter. Each such voxel gives one
/// foot point with a normal; the other voxels measure their distance to the plane of the nearest foot point.
/// @param inside_domain  by leaf; other voxels take no part and get +width.
/// @param width  at most a few voxels; leaves of the band that the result needs must exist.
[[nodiscard]] LeafArray<float> signed_distance(const LeafBand& band, const LeafArray<float>& phi,
                                               const std::vector<LeafMask>& inside_domain, const VoxelBox& box,
                                               float width, const RunContext& run);

/// The grid "band" of u = h * values: leaves without active voxels become tiles, outside +width h, interior -width h.
/// @param active   by leaf.
/// @param interior pieces of `columns` that are runs and lie inside.
[[nodiscard]] FloatGridPtr make_band(const LeafBand& band, const LeafColumns& columns, const LeafArray<float>& values,
                                     const std::vector<LeafMask>& active, const std::vector<bool>& interior,
                                     const Domain& domain, float width);

}  // namespace covol::detail
