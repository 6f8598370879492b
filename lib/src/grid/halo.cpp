#include "grid/halo.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <map>

namespace covol::detail {
namespace {

bool is_face(int slot) { return std::find(std::begin(kFaceSlots), std::end(kFaceSlots), slot) != std::end(kFaceSlots); }

// Index i of a padded buffer, -1..8, is index `local` of the neighbour in direction d.
struct RowSource {
    int d, local;
    explicit RowSource(int i) : d(i < 0 ? -1 : i > 7 ? 1 : 0), local(i & 7) {}
};

/// The blocks across the faces of a leaf, by Face.
void find_across(const HaloField& field, std::size_t leaf, const float* (&across)[6]) {
    for (int face = 0; face < 6; ++face) across[face] = field.values.leaf(field.blocks[leaf][kFaceSlots[face]]);
}

}  // namespace

HaloField gather(const LeafBand& band, const FloatGrid& grid, bool corners, const ConvertBlock& convert) {
    HaloField field;
    field.blocks.resize(band.size());
    std::vector<Coord> missing;
    for (std::size_t leaf = 0; leaf < band.size(); ++leaf) {
        field.blocks[leaf] = band.neighbours(leaf);
        for (int slot = 0; slot < 27; ++slot)
            if (field.blocks[leaf][slot] == band.none() && (corners || is_face(slot)))
                missing.push_back(neighbour_origin(band.origin(leaf), slot));
    }
    std::sort(missing.begin(), missing.end());
    missing.erase(std::unique(missing.begin(), missing.end()), missing.end());

    // Tiles with the same value are represented by one block.
    struct Source {
        const FloatGrid::TreeType::LeafNodeType* leaf;
        float tile;
    };
    std::vector<Source> extra;
    std::vector<std::int32_t> block_of(missing.size());
    std::map<float, std::int32_t> tiles;
    const auto accessor = grid.getConstAccessor();
    for (std::size_t m = 0; m < missing.size(); ++m) {
        const auto next = static_cast<std::int32_t>(band.size() + extra.size());
        if (const auto* leaf = accessor.probeConstLeaf(missing[m])) {
            block_of[m] = next;
            extra.push_back({leaf, 0.0F});
            continue;
        }
        const float value = accessor.getValue(missing[m]);
        const auto [at, is_new] = tiles.emplace(value, next);
        if (is_new) extra.push_back({nullptr, value});
        block_of[m] = at->second;
    }

    field.values = LeafArray<float>(band.size(), 0.0F, extra.size() + 1);
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        const auto* source = grid.tree().probeConstLeaf(band.origin(leaf));
        convert(source, source != nullptr ? 0.0F : grid.tree().getValue(band.origin(leaf)), field.values.leaf(leaf));
        for (int slot = 0; slot < 27; ++slot) {
            std::int32_t& block = field.blocks[leaf][slot];
            if (block != band.none() || !(corners || is_face(slot))) continue;
            const Coord origin = neighbour_origin(band.origin(leaf), slot);
            block = block_of[std::lower_bound(missing.begin(), missing.end(), origin) - missing.begin()];
        }
    });
    for (std::size_t e = 0; e < extra.size(); ++e)
        convert(extra[e].leaf, extra[e].tile, field.values.leaf(band.size() + e));
    return field;
}

void load_padded(const HaloField& field, std::size_t leaf, float* out) {
    const auto& blocks = field.blocks[leaf];
    for (int i = -1; i <= 8; ++i)
        for (int j = -1; j <= 8; ++j) {
            const RowSource si(i), sj(j);
            const int row = leaf_offset(si.local, sj.local, 0);
            const std::int32_t* b = &blocks[neighbour_slot(si.d, sj.d, -1)];
            float* to = out + padded(i, j, 0);
            to[-1] = field.values.leaf(b[0])[row + 7];
            std::memcpy(to, field.values.leaf(b[1]) + row, 8 * sizeof(float));
            to[8] = field.values.leaf(b[2])[row];
        }
}

void load_star(const HaloField& field, std::size_t leaf, float* out) {
    const float* across[6];
    find_across(field, leaf, across);
    load_star_from(field.values.leaf(leaf), across, out);
}

void load_star_from(const float* inner, const float* const across[6], float* out) {
    const float* minus_k = across[kMinusK];
    const float* plus_k = across[kPlusK];
    for (int row = 0; row < 64; ++row) {
        float* to = out + padded(row >> 3, row & 7, 0);
        to[-1] = minus_k[row * 8 + 7];
        std::memcpy(to, inner + row * 8, 8 * sizeof(float));
        to[8] = plus_k[row * 8];
    }
    const auto copy_row = [out](int i, int j, const float* block) {
        std::memcpy(out + padded(i, j, 0), block + leaf_offset(i & 7, j & 7, 0), 8 * sizeof(float));
    };
    for (int n = 0; n < 8; ++n) {
        copy_row(-1, n, across[kMinusI]), copy_row(8, n, across[kPlusI]);
        copy_row(n, -1, across[kMinusJ]), copy_row(n, 8, across[kPlusJ]);
    }
}

LeafStar star_of(HaloField& field, std::size_t leaf) {
    LeafStar star{field.values.leaf(leaf), {}};
    find_across(field, leaf, star.across);
    return star;
}

void prefetch(const LeafStar& star) {
    constexpr int kLine = 16;  // floats
    for (int n = 0; n < kLeafSize; n += kLine) {
        __builtin_prefetch(star.inner + n);
        __builtin_prefetch(star.across[kMinusK] + n);
        __builtin_prefetch(star.across[kPlusK] + n);
    }
    for (int n = 0; n < 64; n += kLine) {
        __builtin_prefetch(star.across[kMinusI] + leaf_offset(7, 0, n));
        __builtin_prefetch(star.across[kPlusI] + n);
    }
    for (int i = 0; i < kLeafDim; ++i) {
        __builtin_prefetch(star.across[kMinusJ] + leaf_offset(i, 7, 0));
        __builtin_prefetch(star.across[kPlusJ] + leaf_offset(i, 0, 0));
    }
}

void store_inner(const float* in, float* leaf) {
    for (int row = 0; row < 64; ++row)
        std::memcpy(leaf + row * 8, in + padded(row >> 3, row & 7, 0), 8 * sizeof(float));
}

LeafBounds::LeafBounds(const Domain& domain, const Coord& origin) {
    for (int a = 0; a < 3; ++a) {
        lo[a] = domain.min[a] - origin[a];
        hi[a] = domain.max[a] - origin[a];
    }
}

bool LeafBounds::cuts() const {
    for (int a = 0; a < 3; ++a)
        if (lo[a] > -1 || hi[a] < 8) return true;
    return false;
}

}  // namespace covol::detail
