#pragma once
#include <cstdint>

namespace covol::detail {

/// A leaf of 8^3 voxels and one layer around it: the point of each voxel, relative to the leaf's first voxel.
struct NearestBlock {
    static constexpr int kRow = 10, kSlice = 100, kSize = 1000;
    static constexpr int offset(int i, int j, int k) { return (i + 1) * kSlice + (j + 1) * kRow + (k + 1); }
    static constexpr float kFar = 1e18F;  ///< coordinates of "no point"; its square is still finite
    float x[kSize], y[kSize], z[kSize];
    std::int32_t index[kSize];
};

/// One forward and one backward sweep: each voxel takes a neighbour's point if that is nearer than its own.
void sweep_nearest(NearestBlock& block);

/// The layers of the halo (-i, +i, -j, +j, -k, +k: bits 0 to 5) in which a voxel would take a nearer point, at a
/// squared distance of at most `reach`, from the block's own voxels.
[[nodiscard]] unsigned improved_faces(const NearestBlock& block, float reach);

/// Copies the block's 512 points to `nearest`.
/// @param changed  out, a bit for each voxel: its point differs from the one before (or `all`) and its squared distance
///     is at most `reach`
void store_points(const NearestBlock& block, float reach, bool all, std::int32_t* nearest, std::uint64_t* changed);

/// Squared distances of the 512 voxels from their points.
void squared_distances(const NearestBlock& block, float* squared);

}  // namespace covol::detail
