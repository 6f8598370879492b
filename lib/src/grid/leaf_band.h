#pragma once
#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/large_allocator.h"
#include "covol/domain.h"
#include "covol/fwd.h"

namespace covol::detail {

using openvdb::Coord;
using openvdb::CoordBBox;

inline constexpr int kLeafDim = 8;
inline constexpr int kLeafSize = 512;  ///< voxels in a leaf; offset = (i*8 + j)*8 + k, as in OpenVDB
inline constexpr int leaf_offset(int i, int j, int k) { return (i * 8 + j) * 8 + k; }

/// One bit per voxel of a leaf; word i holds the slice i, bit j*8+k.
using LeafMask = std::array<std::uint64_t, 8>;
inline bool is_on(const LeafMask& mask, int offset) { return mask[offset >> 6] >> (offset & 63) & 1; }
inline void set_on(LeafMask& mask, int offset) { mask[offset >> 6] |= std::uint64_t(1) << (offset & 63); }
inline int count_on(const LeafMask& mask) {
    int n = 0;
    for (const std::uint64_t word : mask) n += __builtin_popcountll(word);
    return n;
}
inline bool any_on(const LeafMask& mask) {
    std::uint64_t all = 0;
    for (const std::uint64_t word : mask) all |= word;
    return all != 0;
}

/// Index of the neighbour at leaf offset (di,dj,dk), each -1..1, among 27; 13 is the leaf itself.
inline constexpr int neighbour_slot(int di, int dj, int dk) { return (di + 1) * 9 + (dj + 1) * 3 + (dk + 1); }
/// The step in leaves to the neighbour at a slot, and the neighbour's origin.
inline Coord neighbour_step(int slot) { return {slot / 9 - 1, slot / 3 % 3 - 1, slot % 3 - 1}; }
inline Coord neighbour_origin(const Coord& origin, int slot) {
    const Coord step = neighbour_step(slot);
    return origin.offsetBy(step.x() * kLeafDim, step.y() * kLeafDim, step.z() * kLeafDim);
}
/// The slots across the faces, in the order -i, +i, -j, +j, -k, +k.
inline constexpr int kFaceSlots[6] = {neighbour_slot(-1, 0, 0), neighbour_slot(1, 0, 0),  neighbour_slot(0, -1, 0),
                                      neighbour_slot(0, 1, 0),  neighbour_slot(0, 0, -1), neighbour_slot(0, 0, 1)};

/// The leaves of a band as flat arrays: their positions, neighbours and active voxels.
///
/// Leaves are ordered by colour, the parity of I+J+K in leaf units, so that no two leaves of a colour share a face;
/// within a colour they keep OpenVDB's order, which keeps neighbours close in memory. A missing neighbour is
/// `none()` = size(); arrays keep extra blocks from there on (LeafArray).
class LeafBand {
public:
    LeafBand() = default;
    /// The leaves of `grid`, with its active voxels as masks.
    explicit LeafBand(const FloatGrid& grid);
    /// Leaves at these origins (multiples of 8, unique), all masks empty.
    explicit LeafBand(std::vector<Coord> origins);

    [[nodiscard]] std::size_t size() const noexcept { return origins_.size(); }
    [[nodiscard]] std::int32_t none() const noexcept { return static_cast<std::int32_t>(origins_.size()); }
    /// Leaves [0, odd_begin()) are even, [odd_begin(), size()) odd.
    [[nodiscard]] std::size_t odd_begin() const noexcept { return odd_begin_; }
    [[nodiscard]] const Coord& origin(std::size_t leaf) const { return origins_[leaf]; }
    [[nodiscard]] const std::array<std::int32_t, 27>& neighbours(std::size_t leaf) const { return neighbours_[leaf]; }
    [[nodiscard]] const LeafMask& active(std::size_t leaf) const { return active_[leaf]; }
    [[nodiscard]] LeafMask& active(std::size_t leaf) { return active_[leaf]; }
    [[nodiscard]] std::int64_t active_count() const;
    /// The leaf with this origin, or none().
    [[nodiscard]] std::int32_t find(const Coord& origin) const;

private:
    void index();
    [[nodiscard]] std::int32_t find_from(std::size_t& place, std::uint64_t key) const;
    std::vector<Coord> origins_;
    std::vector<std::array<std::int32_t, 27>> neighbours_;
    std::vector<LeafMask> active_;
    std::vector<std::pair<std::uint64_t, std::int32_t>> lookup_;  // packed origin and leaf, sorted
    std::size_t odd_begin_ = 0;
};

/// 512 values for each leaf of a band, then `extra` constant blocks that stand in for missing neighbours.
template <typename T>
class LeafArray {
public:
    LeafArray() = default;
    LeafArray(std::size_t leaves, T fill, std::size_t extra = 1)
        : leaves_(leaves), values_((leaves + extra) * kLeafSize) {
        tbb::parallel_for(std::size_t(0), blocks(), [&](std::size_t block) { fill_block(block, fill); });
    }
    [[nodiscard]] T* leaf(std::size_t i) { return values_.data() + i * kLeafSize; }
    [[nodiscard]] const T* leaf(std::size_t i) const { return values_.data() + i * kLeafSize; }
    [[nodiscard]] std::size_t leaves() const noexcept { return leaves_; }
    /// Leaves and extra blocks.
    [[nodiscard]] std::size_t blocks() const noexcept { return values_.size() / kLeafSize; }
    void fill_block(std::size_t block, T value) { std::fill_n(values_.data() + block * kLeafSize, kLeafSize, value); }

private:
    std::size_t leaves_ = 0;
    std::vector<T, LargeAllocator<T>> values_;
};

/// Copies grid values (active and inactive) of every leaf; leaves that the grid lacks get the value of the tile there.
void import_values(const FloatGrid& grid, const LeafBand& band, LeafArray<float>& values);

/// A grid with the band's leaves and active voxels and these values; inactive voxels take `values` too.
[[nodiscard]] FloatGridPtr export_grid(const LeafBand& band, const LeafArray<float>& values, const Domain& domain,
                                       float background, const char* name);

/// Leaves, sorted and unique, within `rings` leaves (26-neighbourhood) of the given ones, without those that do not
/// touch the domain.
[[nodiscard]] std::vector<Coord> dilate_leaves(const std::vector<Coord>& origins, int rings, const Domain& domain);

/// The domain's voxels, both ends inclusive.
[[nodiscard]] CoordBBox box_of(const Domain& domain);
/// The voxels of the leaf at `origin` that lie in the box.
[[nodiscard]] LeafMask mask_in_box(const Coord& origin, const CoordBBox& box);

}  // namespace covol::detail
