#pragma once
#include "grid/leaf_columns.h"

namespace covol::detail {

/// Signed distance, in voxels and clamped to [-width, width], to the interface between voxels of phi < 0 and phi >= 0.
///
/// Beside the interface, phi determines its position between two voxels; the scale of phi does not matter. Each
/// voxel beside the interface gives one foot point with a normal; the distances of the other voxels are those to the
/// plane of the nearest foot point.
/// @param inside_domain  by leaf: the voxels in the domain; all others are ignored and get +width.
/// @param width  at most a few voxels. The band must contain all leaves within this distance of the interface.
[[nodiscard]] LeafArray<float> signed_distance(const LeafBand& band, const LeafArray<float>& phi,
                                               const std::vector<LeafMask>& inside_domain, const CoordBBox& box,
                                               float width, const RunContext& run);

/// The grid "band": h * u on the leaves, clamped to [-width h, width h], and tiles of -width h where the inside has no
/// leaf; the background is width h.
/// @param u         voxels, by leaf; voxels outside the domain must be +width.
/// @param active    by leaf: the voxels to be active.
/// @param interior  by piece of `columns`: whether the piece is a run without leaves that lies inside.
[[nodiscard]] FloatGridPtr make_band(const LeafBand& band, const LeafColumns& columns, const LeafArray<float>& u,
                                     const std::vector<LeafMask>& active, const std::vector<bool>& interior,
                                     const Domain& domain, float width);

/// The start of an evolution from a signed distance u in voxels: make_band, active where |u| < kHalfWidthVoxels.
/// @param u  by leaf; modified: clamped, and outside of the domain set to the outside value.
/// @throws Error InvalidInput if no voxel is active; `where` is the caller's name.
[[nodiscard]] FloatGridPtr make_start(const LeafBand& band, LeafArray<float>& u, const Domain& domain,
                                      const char* where);

}  // namespace covol::detail
