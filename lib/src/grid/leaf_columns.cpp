#include "grid/leaf_columns.h"

#include <algorithm>
#include <numeric>

namespace covol::detail {
namespace {

constexpr std::uint64_t kFirstInRow = 0x0101010101010101U;  // k = 0 of the eight rows of a slice
constexpr std::uint64_t kLastInRow = kFirstInRow << 7;

/// The voxels of a leaf at its face towards (di,dj,dk).
LeafMask face_of(int di, int dj, int dk) {
    LeafMask mask{};
    if (di != 0) {
        mask[di < 0 ? 0 : 7] = ~std::uint64_t(0);
    } else {
        mask.fill(dj < 0 ? 0xffU : dj > 0 ? std::uint64_t(0xff) << 56 : dk < 0 ? kFirstInRow : kLastInRow);
    }
    return mask;
}

/// The neighbour's voxels that lie across the face towards (di,dj,dk) from voxels of `mask`.
LeafMask across(const LeafMask& mask, int di, int dj, int dk) {
    LeafMask result{};
    if (di != 0) {
        result[di < 0 ? 7 : 0] = mask[di < 0 ? 0 : 7];
        return result;
    }
    for (int i = 0; i < 8; ++i) {
        if (dj < 0) result[i] = mask[i] << 56;
        if (dj > 0) result[i] = mask[i] >> 56;
        if (dk < 0) result[i] = (mask[i] & kFirstInRow) << 7;
        if (dk > 0) result[i] = (mask[i] & kLastInRow) >> 7;
    }
    return result;
}

/// The voxels of a leaf that lie on the domain's outermost layer.
LeafMask boundary_layer(const Coord& origin, const CoordBBox& domain) {
    LeafMask layer = mask_in_box(origin, domain);
    const LeafMask inner = mask_in_box(origin, {domain.min().offsetBy(1), domain.max().offsetBy(-1)});
    for (int i = 0; i < 8; ++i) layer[i] &= ~inner[i];
    return layer;
}

}  // namespace

void spread(LeafMask& mask, const LeafMask& open) {
    const auto step = [&](int i) {
        std::uint64_t m = mask[i];
        if (i > 0) m |= mask[i - 1];
        if (i < 7) m |= mask[i + 1];
        // Closed voxels are removed before the mask spreads within the slice; it would otherwise spread through them.
        m &= open[i];
        for (std::uint64_t before = 0; before != m;) {
            before = m;
            m |= (m << 1 & ~kFirstInRow) | (m >> 1 & ~kLastInRow) | m << 8 | m >> 8;
            m &= open[i];
        }
        const bool changed = m != mask[i];
        mask[i] = m;
        return changed;
    };
    for (bool changed = true; changed;) {
        changed = false;
        for (int i = 0; i < 8; ++i) changed |= step(i);
        for (int i = 7; i >= 0; --i) changed |= step(i);
    }
}

LeafColumns::LeafColumns(const LeafBand& band, const CoordBBox& domain, Extent extent) {
    const auto block = [](const Coord& voxel) { return Coord(voxel.x() >> 3, voxel.y() >> 3, voxel.z() >> 3); };
    std::vector<std::size_t> order(band.size());
    std::iota(order.begin(), order.end(), std::size_t(0));
    std::sort(order.begin(), order.end(), [&](auto a, auto b) { return band.origin(a) < band.origin(b); });
    lo_ = hi_ = block(band.origin(0));
    for (const std::size_t leaf : order) {
        lo_ = Coord::minComponent(lo_, block(band.origin(leaf)));
        hi_ = Coord::maxComponent(hi_, block(band.origin(leaf)));
    }
    const bool whole = extent == Extent::Domain;
    lo_ = whole ? block(domain.min()) : Coord::maxComponent(lo_.offsetBy(-1), block(domain.min()));
    hi_ = whole ? block(domain.max()) : Coord::minComponent(hi_.offsetBy(1), block(domain.max()));
    piece_of_leaf_.resize(band.size());
    std::size_t next = 0;
    for (int i = lo_.x(); i <= hi_.x(); ++i)
        for (int j = lo_.y(); j <= hi_.y(); ++j) {
            const auto column = std::int32_t(start_.size());
            start_.push_back(std::int32_t(pieces_.size()));
            std::int32_t k = lo_.z();
            for (; next < order.size(); ++next) {
                const Coord at = block(band.origin(order[next]));
                if (at.x() != i || at.y() != j) break;
                if (at.z() > k) pieces_.push_back({k, at.z(), -1, column});
                piece_of_leaf_[order[next]] = std::int32_t(pieces_.size());
                pieces_.push_back({at.z(), at.z() + 1, std::int32_t(order[next]), column});
                k = at.z() + 1;
            }
            if (k <= hi_.z()) pieces_.push_back({k, hi_.z() + 1, -1, column});
        }
    start_.push_back(std::int32_t(pieces_.size()));
}

CoordBBox LeafColumns::voxels(const Piece& piece) const {
    const int width = hi_.y() - lo_.y() + 1;
    const int i = (lo_.x() + piece.column / width) * kLeafDim, j = (lo_.y() + piece.column % width) * kLeafDim;
    return {Coord(i, j, piece.begin * kLeafDim), Coord(i + kLeafDim - 1, j + kLeafDim - 1, piece.end * kLeafDim - 1)};
}

std::int32_t LeafColumns::find_in(std::int32_t column, std::int32_t k) const {
    const auto after = std::upper_bound(pieces_.begin() + start_[column], pieces_.begin() + start_[column + 1], k,
                                        [](std::int32_t value, const Piece& piece) { return value < piece.begin; });
    return std::int32_t(after - pieces_.begin()) - 1;
}

std::int32_t LeafColumns::find(const Coord& voxel) const {
    const Coord at(voxel.x() >> 3, voxel.y() >> 3, voxel.z() >> 3);
    for (int a = 0; a < 3; ++a)
        if (at[a] < lo_[a] || at[a] > hi_[a]) return -1;
    return find_in((at.x() - lo_.x()) * (hi_.y() - lo_.y() + 1) + at.y() - lo_.y(), at.z());
}

bool LeafColumns::at_border(const Piece& piece) const {
    const int width = hi_.y() - lo_.y() + 1, i = piece.column / width, j = piece.column % width;
    return i == 0 || i == hi_.x() - lo_.x() || j == 0 || j == width - 1 || piece.begin == lo_.z() ||
           piece.end == hi_.z() + 1;
}

std::vector<bool> inside_runs(const LeafColumns& columns, const std::vector<LeafMask>& inside) {
    const auto& pieces = columns.pieces();
    std::vector<bool> result(pieces.size(), false);
    std::vector<std::int32_t> work;
    const auto enter = [&](std::int32_t number) {
        if (pieces[number].leaf >= 0 || result[number]) return;
        result[number] = true;
        work.push_back(number);
    };
    for (std::size_t leaf = 0; leaf < inside.size(); ++leaf)
        columns.for_each_neighbour(columns.piece_of_leaf(leaf), [&](std::int32_t other, int di, int dj, int dk) {
            if (any_on(across(inside[leaf], di, dj, dk))) enter(other);
        });
    while (!work.empty()) {
        const std::int32_t number = work.back();
        work.pop_back();
        columns.for_each_neighbour(number, [&](std::int32_t other, int, int, int) { enter(other); });
    }
    return result;
}

Flood flood(const LeafColumns& columns, const LeafBand& band, const std::vector<LeafMask>& open,
            const CoordBBox& domain, const std::vector<Coord>& seeds) {
    const auto& pieces = columns.pieces();
    Flood result{std::vector<LeafMask>(band.size(), LeafMask{}), std::vector<bool>(pieces.size(), false)};
    std::vector<std::int32_t> work;
    std::vector<bool> waiting(pieces.size(), false);
    const auto enter_run = [&](std::int32_t number) {
        if (result.pieces[number]) return;
        result.pieces[number] = true;
        work.push_back(number);
    };
    const auto enter_leaf = [&](std::int32_t number, const LeafMask& from) {
        const std::int32_t leaf = pieces[number].leaf;
        LeafMask fresh;
        for (int w = 0; w < 8; ++w) fresh[w] = from[w] & open[leaf][w] & ~result.leaves[leaf][w];
        if (!any_on(fresh)) return;
        for (int w = 0; w < 8; ++w) result.leaves[leaf][w] |= fresh[w];
        if (!waiting[number]) work.push_back(number);
        waiting[number] = true;
    };
    for (std::int32_t n = 0; n < std::int32_t(pieces.size()); ++n) {
        if (!columns.at_border(pieces[n])) continue;
        if (pieces[n].leaf < 0)
            enter_run(n);
        else
            enter_leaf(n, boundary_layer(band.origin(pieces[n].leaf), domain));
    }
    for (const Coord& seed : seeds) {
        const std::int32_t n = columns.find(seed);
        if (n < 0) continue;
        if (pieces[n].leaf < 0) {
            enter_run(n);
        } else {
            LeafMask mask{};
            set_on(mask, leaf_offset(seed.x() & 7, seed.y() & 7, seed.z() & 7));
            enter_leaf(n, mask);
        }
    }
    while (!work.empty()) {
        const std::int32_t number = work.back();
        work.pop_back();
        waiting[number] = false;
        const std::int32_t leaf = pieces[number].leaf;
        if (leaf >= 0) spread(result.leaves[leaf], open[leaf]);
        columns.for_each_neighbour(number, [&](std::int32_t other, int di, int dj, int dk) {
            const LeafMask there = leaf < 0 ? face_of(-di, -dj, -dk) : across(result.leaves[leaf], di, dj, dk);
            if (pieces[other].leaf >= 0)
                enter_leaf(other, there);
            else if (any_on(there))
                enter_run(other);
        });
    }
    return result;
}

}  // namespace covol::detail
