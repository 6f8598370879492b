#pragma once
#include <cstdint>

namespace covol::detail {

/// A leaf of 8^3 voxels and one layer around it: the point that each voxel holds, relative to the leaf's first voxel.
struct NearestBlock {
    static constexpr int kRow = 10, kSlice = 100, kSize = 1000;
    static constexpr int offset(int i, int j, int k) { return (i + 1) * kSlice + (j + 1) * kRow + (k + 1); }
    static constexpr float kFar = 1e18F;  ///< coordinates of "no point"; its square is still finite
    float x[kSize], y[kSize], z[kSize];
    std::int32_t index[kSize];
};

/// One forward and one backward sweep: each voxel takes a neighbour's point where that is nearer than its own.
void sweep_nearest(NearestBlock& block);

/// Which of the six layers of the halo (-i, +i, -j, +j, -k, +k: bits 0 to 5) hold a voxel that would take a nearer
/// point, at a squared distance up to `reach`, from the block's own voxels.
[[nodiscard]] unsigned faces_with_news(const NearestBlock& block, float reach);

/// Takes the block's points over into `nearest`, 512 of them. @param changed  out, a bit for each voxel: its point is
/// another one than before (or `all`) and its squared distance is at most `reach`
void take_points(const NearestBlock& block, float reach, bool all, std::int32_t* nearest, std::uint64_t* changed);

/// Squared distances of the 512 voxels to the points they hold.
void squared_distances(const NearestBlock& block, float* squared);

}  // namespace covol::detail
