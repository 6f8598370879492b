#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "grid/leaf_band.h"
#include "scheme/scheme.h"

namespace covol::detail {

/// Values on a band's leaves, and for each leaf the 27 blocks around it. Blocks from band.size() on represent the
/// surroundings of the band: copies of a grid's leaves, and constant blocks for its tiles.
struct HaloField {
    LeafArray<float> values;
    std::vector<std::array<std::int32_t, 27>> blocks;
};

/// Fills one block from a grid's leaf, or from a tile's value if `leaf` is null.
using ConvertBlock = std::function<void(const FloatGrid::TreeType::LeafNodeType* leaf, float tile, float* block)>;

/// Gathers `grid` on the band and in the blocks around it. @param corners  false: only the six faces are needed
[[nodiscard]] HaloField gather(const LeafBand& band, const FloatGrid& grid, bool corners, const ConvertBlock& convert);

/// A padded buffer (see scheme.h) with edges and corners.
void load_padded(const HaloField& field, std::size_t leaf, float* out);
/// Loads the buffer of load_padded() except its edges and corners, which are not written.
void load_star(const HaloField& field, std::size_t leaf, float* out);
/// Does what load_star() does, from the leaf's own block of 512 values and the six blocks across its faces, by Face.
void load_star_from(const float* inner, const float* const across[6], float* out);
/// Pointers to the blocks that load_star() reads; nothing is copied.
[[nodiscard]] LeafStar star_of(HaloField& field, std::size_t leaf);
/// Prefetches the values of a star that a sweep reads.
void prefetch(const LeafStar& star);
/// Writes a padded buffer's inner 8^3 voxels back.
void store_inner(const float* in, float* leaf);

/// The domain's boundary relative to a leaf; local voxel indices, inclusive.
struct LeafBounds {
    int lo[3], hi[3];
    LeafBounds(const Domain& domain, const Coord& origin);
    /// Whether the leaf or its halo extends beyond the domain.
    [[nodiscard]] bool cuts() const;
    [[nodiscard]] bool contains(int i, int j, int k) const {
        return i >= lo[0] && i <= hi[0] && j >= lo[1] && j <= hi[1] && k >= lo[2] && k <= hi[2];
    }
};

}  // namespace covol::detail
