#include "detail/follow.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "detail/leaf_band.h"

namespace covol::detail {
namespace {

using Masks = std::vector<LeafMask>;

// A leaf's bits and one layer around them: bit k+1 of row (i+1, j+1).
using PaddedMask = std::array<std::array<std::uint16_t, 10>, 10>;

unsigned leaf_row(const LeafMask& mask, int i, int j) { return unsigned(mask[i] >> (8 * j)) & 0xffU; }

PaddedMask pad(const LeafBand& band, const Masks& masks, std::size_t leaf) {
    static constexpr LeafMask kEmpty{};
    const auto& neighbours = band.neighbours(leaf);
    const auto mask_of = [&](int di, int dj, int dk) -> const LeafMask& {
        const std::int32_t n = neighbours[neighbour_slot(di, dj, dk)];
        return n == band.none() ? kEmpty : masks[n];
    };
    PaddedMask out;
    for (int i = -1; i <= 8; ++i)
        for (int j = -1; j <= 8; ++j) {
            const int di = i < 0 ? -1 : i > 7, dj = j < 0 ? -1 : j > 7;
            const unsigned low = leaf_row(mask_of(di, dj, -1), i & 7, j & 7) >> 7;
            const unsigned high = leaf_row(mask_of(di, dj, 1), i & 7, j & 7) & 1U;
            out[i + 1][j + 1] = std::uint16_t(low | leaf_row(mask_of(di, dj, 0), i & 7, j & 7) << 1 | high << 9);
        }
    return out;
}

// The leaf's bits dilated by the 6-neighbourhood, or by the 26-neighbourhood.
LeafMask dilated(const PaddedMask& bits, bool cube) {
    const auto spread = [](unsigned row) { return row | row << 1 | row >> 1; };
    LeafMask out{};
    for (int i = 1; i <= 8; ++i)
        for (int j = 1; j <= 8; ++j) {
            unsigned row = spread(bits[i][j]);
            const unsigned sides = bits[i - 1][j] | bits[i + 1][j] | bits[i][j - 1] | bits[i][j + 1];
            if (cube)
                row |= spread(sides | bits[i - 1][j - 1] | bits[i - 1][j + 1] | bits[i + 1][j - 1] | bits[i + 1][j + 1]);
            else
                row |= sides;
            out[i - 1] |= std::uint64_t(row >> 1 & 0xffU) << (8 * (j - 1));
        }
    return out;
}

// Alternating both neighbourhoods approximates a ball.
Masks dilate(const LeafBand& band, Masks masks, int steps) {
    Masks next(masks.size());
    for (int step = 0; step < steps; ++step) {
        tbb::parallel_for(std::size_t(0), band.size(),
                          [&](std::size_t leaf) { next[leaf] = dilated(pad(band, masks, leaf), step % 2 == 1); });
        masks.swap(next);
    }
    return masks;
}

LeafMask domain_mask(const Domain& domain, const Coord& origin) {
    LeafMask mask{};
    for (int n = 0; n < kLeafSize; ++n) {
        const Coord at = origin.offsetBy(n >> 6, (n >> 3) & 7, n & 7);
        bool inside = true;
        for (int a = 0; a < 3; ++a) inside &= at[a] >= domain.min[a] && at[a] <= domain.max[a];
        if (inside) set_on(mask, n);
    }
    return mask;
}

// Voxels with a face neighbour of the other sign.
Masks sign_changes(const FloatGrid& u, const LeafBand& band) {
    Masks negative(band.size());
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        const float* values = u.tree().probeConstLeaf(band.origin(leaf))->buffer().data();
        negative[leaf] = {};
        for (int n = 0; n < kLeafSize; ++n)
            if (values[n] < 0.0F) set_on(negative[leaf], n);
    });
    Masks changes(band.size());
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        // Positive voxels with a negative neighbour, and the reverse: dilate one sign into the other. A tile beside
        // the leaf has one sign; its voxels are looked at through the accessor.
        PaddedMask bits = pad(band, negative, leaf);
        const auto& neighbours = band.neighbours(leaf);
        const auto accessor = u.getConstAccessor();
        const auto tile_is_negative = [&](int di, int dj, int dk) {
            return neighbours[neighbour_slot(di, dj, dk)] == band.none() &&
                   accessor.getValue(band.origin(leaf).offsetBy(di * 8, dj * 8, dk * 8)) < 0.0F;
        };
        const bool low_i = tile_is_negative(-1, 0, 0), high_i = tile_is_negative(1, 0, 0);
        const bool low_j = tile_is_negative(0, -1, 0), high_j = tile_is_negative(0, 1, 0);
        const bool low_k = tile_is_negative(0, 0, -1), high_k = tile_is_negative(0, 0, 1);
        for (int n = 1; n <= 8; ++n) {
            if (low_i) bits[0][n] |= 0x1fe;
            if (high_i) bits[9][n] |= 0x1fe;
            if (low_j) bits[n][0] |= 0x1fe;
            if (high_j) bits[n][9] |= 0x1fe;
            for (int j = 1; j <= 8; ++j) {
                if (low_k) bits[n][j] |= 0x001;
                if (high_k) bits[n][j] |= 0x200;
            }
        }
        PaddedMask inverse = bits;
        for (auto& slab : inverse)
            for (auto& row : slab) row = std::uint16_t(~row) & 0x3ff;
        const LeafMask near_negative = dilated(bits, false), near_positive = dilated(inverse, false);
        for (int word = 0; word < 8; ++word)
            changes[leaf][word] =
                (near_negative[word] & ~negative[leaf][word]) | (near_positive[word] & negative[leaf][word]);
    });
    return changes;
}

}  // namespace

void follow_surface(FloatGrid& u, const Domain& domain) {
    const LeafBand old_band(u);
    const Masks changes = sign_changes(u, old_band);

    std::vector<Coord> crossed;
    for (std::size_t leaf = 0; leaf < old_band.size(); ++leaf)
        if (any_on(changes[leaf])) crossed.push_back(old_band.origin(leaf));
    const LeafBand band(dilate_leaves(crossed, 1, domain));
    Masks masks(band.size(), LeafMask{});
    for (std::size_t leaf = 0; leaf < band.size(); ++leaf)
        if (const std::int32_t old = old_band.find(band.origin(leaf)); old != old_band.none()) masks[leaf] = changes[old];
    masks = dilate(band, std::move(masks), kFollowWidth);

    const float w = u.background();
    auto& tree = u.tree();
    for (std::size_t leaf = 0; leaf < band.size(); ++leaf)
        if (any_on(masks[leaf])) tree.touchLeaf(band.origin(leaf));
    const auto set_mask = [&](const Coord& origin, const LeafMask& on) {
        auto* node = tree.probeLeaf(origin);
        auto mask = node->valueMask();
        for (int n = 0; n < kLeafSize; ++n)
            if (!is_on(on, n) && mask.isOn(n)) node->setValueOnly(n, node->getValue(n) < 0.0F ? -w : w);
        for (int word = 0; word < 8; ++word) mask.template getWord<std::uint64_t>(word) = on[word];
        node->setValueMask(mask);
    };
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        if (!any_on(masks[leaf])) return;
        const LeafMask inside = domain_mask(domain, band.origin(leaf));
        for (int word = 0; word < 8; ++word) masks[leaf][word] &= inside[word];
        set_mask(band.origin(leaf), masks[leaf]);
    });
    for (std::size_t leaf = 0; leaf < old_band.size(); ++leaf) {
        const Coord& origin = old_band.origin(leaf);
        const std::int32_t kept = band.find(origin);
        if (kept != band.none() && any_on(masks[kept])) continue;
        // Far from every sign change the leaf has one sign.
        const bool negative = tree.probeLeaf(origin)->getFirstValue() < 0.0F;
        tree.addTile(1, origin, negative ? -w : w, false);
    }
}

}  // namespace covol::detail
