#include "grid/leaf_band.h"

#include <openvdb/tree/LeafManager.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <string>

#include "covol/error.h"

namespace covol::detail {
namespace {

// A key with 21 bits for each axis, which hold every index of a leaf along an axis of 2^24 voxels.
std::uint64_t pack(const Coord& origin) {
    constexpr std::int64_t kBias = 1 << 20;
    const auto field = [](std::int32_t v) { return std::uint64_t(std::int64_t(v >> 3) + kBias) & 0x1fffff; };
    return field(origin.x()) << 42 | field(origin.y()) << 21 | field(origin.z());
}

/// Rejects bands of about 2^24 voxels or more along an axis: leaves that are so far apart could have the same key.
void require_packable(const std::vector<Coord>& origins) {
    constexpr std::int64_t kMax = 1 << 24;
    for (int a = 0; a < 3 && !origins.empty(); ++a) {
        const auto [low, high] = std::minmax_element(
            origins.begin(), origins.end(), [a](const Coord& one, const Coord& other) { return one[a] < other[a]; });
        const std::int64_t length = std::int64_t((*high)[a]) - (*low)[a] + kLeafDim;
        if (length > kMax - 2 * kLeafDim)
            throw Error(Errc::Unsupported, "the band is " + std::to_string(length) +
                                               " voxels long along an axis, expected less than 2^24; use a larger "
                                               "voxel size");
    }
}

constexpr std::size_t kNextKeys = 8;  // number of keys that are checked before a binary search

bool is_odd(const Coord& origin) { return ((origin.x() ^ origin.y() ^ origin.z()) >> 3) & 1; }

}  // namespace

LeafBand::LeafBand(const FloatGrid& grid) {
    std::vector<const FloatGrid::TreeType::LeafNodeType*> leaves;
    leaves.reserve(grid.tree().leafCount());
    grid.tree().getNodes(leaves);
    const auto middle =
        std::stable_partition(leaves.begin(), leaves.end(), [](const auto* leaf) { return !is_odd(leaf->origin()); });
    odd_begin_ = static_cast<std::size_t>(middle - leaves.begin());
    origins_.resize(leaves.size());
    active_.resize(leaves.size());
    tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t i) {
        origins_[i] = leaves[i]->origin();
        for (int word = 0; word < 8; ++word)
            active_[i][word] = leaves[i]->valueMask().template getWord<std::uint64_t>(word);
    });
    index();
}

LeafBand::LeafBand(std::vector<Coord> origins) : origins_(std::move(origins)) {
    const auto middle =
        std::stable_partition(origins_.begin(), origins_.end(), [](const Coord& o) { return !is_odd(o); });
    odd_begin_ = static_cast<std::size_t>(middle - origins_.begin());
    active_.resize(origins_.size(), LeafMask{});
    index();
}

void LeafBand::index() {
    require_packable(origins_);
    lookup_.resize(origins_.size());
    tbb::parallel_for(std::size_t(0), origins_.size(), [&](std::size_t i) {
        lookup_[i] = {pack(origins_[i]), static_cast<std::int32_t>(i)};
    });
    tbb::parallel_sort(lookup_);
    neighbours_.resize(origins_.size());
    // Leaves are visited in the order of their keys. In each of the nine directions (di,dj), the keys of the neighbours
    // then increase, too, so that each search continues from its last position.
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, lookup_.size(), 256), [&](const auto& range) {
        std::array<std::size_t, 9> places{};
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const std::int32_t leaf = lookup_[n].second;
            for (int slot = 0; slot < 27; ++slot)
                neighbours_[leaf][slot] = find_from(places[slot / 3], pack(neighbour_origin(origins_[leaf], slot)));
        }
    });
}

// The leaf with this key, or none().
// @param place  out: position in lookup_ of the first entry whose key is not below `key`; in: where the search begins
std::int32_t LeafBand::find_from(std::size_t& place, std::uint64_t key) const {
    const auto is_below = [](const auto& entry, std::uint64_t k) { return entry.first < k; };
    const std::size_t end = lookup_.size(), last = std::min(place + kNextKeys, end);
    const bool is_ahead = place == 0 || lookup_[place - 1].first < key;
    while (is_ahead && place < last && lookup_[place].first < key) ++place;
    if (!is_ahead || place == last)
        place = std::size_t(std::lower_bound(lookup_.begin(), lookup_.end(), key, is_below) - lookup_.begin());
    return place < end && lookup_[place].first == key ? lookup_[place].second : none();
}

std::int32_t LeafBand::find(const Coord& origin) const {
    std::size_t place = lookup_.size();
    return find_from(place, pack(origin));
}

std::int64_t LeafBand::active_count() const {
    std::int64_t n = 0;
    for (const LeafMask& mask : active_) n += count_on(mask);
    return n;
}

void import_values(const FloatGrid& grid, const LeafBand& band, LeafArray<float>& values) {
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t i) {
        if (const auto* leaf = grid.tree().probeConstLeaf(band.origin(i)))
            std::copy_n(leaf->buffer().data(), kLeafSize, values.leaf(i));
        else
            std::fill_n(values.leaf(i), kLeafSize, grid.tree().getValue(band.origin(i)));
    });
}

FloatGridPtr export_grid(const LeafBand& band, const LeafArray<float>& values, const Domain& domain, float background,
                         const char* name) {
    FloatGridPtr grid = make_grid(domain, background, name);
    auto& tree = grid->tree();
    std::vector<FloatGrid::TreeType::LeafNodeType*> leaves(band.size());
    for (std::size_t i = 0; i < band.size(); ++i) leaves[i] = tree.touchLeaf(band.origin(i));
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t i) {
        std::copy_n(values.leaf(i), kLeafSize, leaves[i]->buffer().data());
        auto mask = leaves[i]->valueMask();
        for (int word = 0; word < 8; ++word) mask.template getWord<std::uint64_t>(word) = band.active(i)[word];
        leaves[i]->setValueMask(mask);
    });
    return grid;
}

std::vector<Coord> dilate_leaves(const std::vector<Coord>& origins, int rings, const Domain& domain) {
    const auto touches = [&](const Coord& o) {
        for (int a = 0; a < 3; ++a)
            if (o[a] > domain.max[a] || o[a] + kLeafDim - 1 < domain.min[a]) return false;
        return true;
    };
    // One axis after the other: duplicates are removed after each, so that for connected leaves far fewer than (2 rings
    // + 1)^3 copies of each leaf are made.
    std::vector<Coord> result = origins;
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<Coord> grown;
        grown.reserve(result.size() * (2 * rings + 1));
        for (const Coord& o : result)
            for (int step = -rings; step <= rings; ++step) {
                Coord moved = o;
                moved[axis] += step * kLeafDim;
                grown.push_back(moved);
            }
        std::sort(grown.begin(), grown.end());
        grown.erase(std::unique(grown.begin(), grown.end()), grown.end());
        result.swap(grown);
    }
    result.erase(std::remove_if(result.begin(), result.end(), [&](const Coord& o) { return !touches(o); }),
                 result.end());
    return result;
}

CoordBBox box_of(const Domain& domain) {
    return {Coord(domain.min[0], domain.min[1], domain.min[2]), Coord(domain.max[0], domain.max[1], domain.max[2])};
}

LeafMask mask_in_box(const Coord& origin, const CoordBBox& box) {
    const Coord lo = Coord::maxComponent(box.min() - origin, Coord(0));
    const Coord hi = Coord::minComponent(box.max() - origin, Coord(kLeafDim - 1));
    LeafMask mask{};
    if (lo == Coord(0) && hi == Coord(kLeafDim - 1)) {
        mask.fill(~std::uint64_t(0));
        return mask;
    }
    for (int i = lo.x(); i <= hi.x(); ++i)
        for (int j = lo.y(); j <= hi.y(); ++j)
            for (int k = lo.z(); k <= hi.z(); ++k) set_on(mask, leaf_offset(i, j, k));
    return mask;
}

}  // namespace covol::detail
