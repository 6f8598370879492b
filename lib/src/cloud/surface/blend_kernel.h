#pragma once
// Blends quadrics over the voxels of one leaf, eight at a time. Positions are relative to the leaf's first voxel, in
// world units; voxel (i, j, k) of 8^3 is at index 64 i + 8 j + k.
#include <array>
#include <cstddef>
#include <cstdint>

namespace covol::cloud {

struct BlendSheet {
    float origin[3], axes[3][3], c[6];  ///< as in Sheet
};

struct BlendPiece {
    float foot[3], reach, normal[3];  ///< the piece applies up to the distance `reach` from its foot, see Sheet::foot()
    BlendSheet sheets[3];
    int count;                                ///< number of sheets
    bool first_is_convex, others_are_convex;  ///< as in Crease
};

struct BlendLeaf {
    static constexpr float kNone = 1e30F;
    /// By voxel: the minimum over the pieces of (distance from the piece's foot / its reach)^2.
    alignas(32) std::array<float, 512> fraction;
    alignas(32) std::array<std::int32_t, 512> nearest;         ///< piece with that minimum; -1: none reaches the voxel
    alignas(32) std::array<std::array<float, 512>, 3> normal;  ///< normal of that piece
    /// Sums of weight * distance and of the weights, over the pieces whose normals are less than 90 degrees from
    /// `normal`.
    alignas(32) std::array<float, 512> sum, weight;
};

/// Fills a leaf of voxels of edge h. Rows whose voxels are all farther than `limit` from their nearest pieces are
/// computed from these alone.
void blend(const BlendPiece* pieces, std::size_t count, float h, float limit, BlendLeaf& leaf);

}  // namespace covol::cloud
