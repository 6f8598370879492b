#pragma once
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <functional>
#include <vector>

#include "covol/run.h"
#include "grid/leaf_band.h"

namespace covol::detail {

/// The voxels of a leaf next to marked voxels in direction `axis` (0..2), `sign` (-1 or 1): bit p is set if the voxel p
/// + sign * e_axis is marked. `mask` marks voxels of the leaf itself, `halo` those of the leaf next to it in that
/// direction (an empty `mask` or `halo` is ignored).
inline LeafMask beside_marked(const LeafMask& mask, const LeafMask& halo, int axis, int sign) {
    constexpr std::uint64_t kFirstK = 0x0101010101010101ULL;  // voxels with k = 0
    constexpr std::uint64_t kLastK = kFirstK << 7;
    LeafMask result;
    for (int i = 0; i < 8; ++i) {
        switch (axis) {
            case 0: {
                const int from = i + sign;
                result[i] = from < 0 ? halo[7] : from > 7 ? halo[0] : mask[from];
                break;
            }
            case 1: result[i] = sign > 0 ? mask[i] >> 8 | halo[i] << 56 : mask[i] << 8 | halo[i] >> 56; break;
            default:
                result[i] = sign > 0 ? (mask[i] & ~kFirstK) >> 1 | (halo[i] & kFirstK) << 7
                                     : (mask[i] & ~kLastK) << 1 | (halo[i] & kLastK) >> 7;
        }
    }
    return result;
}

/// Propagates values over a band from voxel to face neighbour until nothing changes, in parallel.
///
/// `relax(leaf, p, other, q)` updates voxel p of `leaf` from its face neighbour q in the leaf `other`, and returns
/// whether p changed; it may only write to `leaf`. It is called for each neighbour that changed since the last update.
/// Leaves of one colour share no face, so that they run in parallel without races, and every value depends only on the
/// order within leaves and of the two colours: it is bit-identical for any number of threads.
/// @param changed  in: the voxels to start from; out: empty masks.
/// @return number of passes over the leaves.
template <typename Relax>
int propagate(const LeafBand& band, std::vector<LeafMask>& changed, const RunContext& run, const Relax& relax) {
    constexpr LeafMask kNone{};
    std::vector<LeafMask> start = changed;  // from which each leaf propagates within itself in its first visit

    const auto visit = [&](std::size_t leaf, const LeafMask& own) {
        LeafMask front = own, all = own;
        bool first = true;
        do {
            LeafMask next{};
            for (int axis = 0; axis < 3; ++axis)
                for (int sign = -1; sign <= 1; sign += 2) {
                    const std::int32_t across = band.neighbours(
                        leaf)[neighbour_slot(axis == 0 ? sign : 0, axis == 1 ? sign : 0, axis == 2 ? sign : 0)];
                    const LeafMask& halo = first && across != band.none() ? changed[across] : kNone;
                    const LeafMask look = beside_marked(front, halo, axis, sign);
                    const int shift = axis == 0 ? 6 : axis == 1 ? 3 : 0;
                    for (int word = 0; word < 8; ++word)
                        for (std::uint64_t bits = look[word]; bits != 0; bits &= bits - 1) {
                            const int p = word << 6 | __builtin_ctzll(bits);
                            const int at = p >> shift & 7;
                            const bool inside = sign < 0 ? at > 0 : at < 7;
                            const int q = inside ? p + sign * (1 << shift) : p - sign * (7 << shift);
                            if (relax(leaf, p, inside ? leaf : std::size_t(across), q)) set_on(next, p);
                        }
                }
            front = next;
            for (int word = 0; word < 8; ++word) all[word] |= next[word];
            first = false;
        } while (any_on(front));
        changed[leaf] = all;
        return any_on(all);
    };

    int passes = 0;
    for (bool again = true; again; ++passes) {
        run.check();
        again = false;
        const std::size_t begins[3] = {0, band.odd_begin(), band.size()};
        for (int colour = 0; colour < 2; ++colour)
            again |= tbb::parallel_reduce(
                tbb::blocked_range<std::size_t>(begins[colour], begins[colour + 1], 8), false,
                [&](const tbb::blocked_range<std::size_t>& range, bool any) {
                    for (std::size_t leaf = range.begin(); leaf != range.end(); ++leaf)
                        any |= visit(leaf, passes == 0 ? start[leaf] : kNone);
                    return any;
                },
                std::logical_or<>());
    }
    return passes;
}

}  // namespace covol::detail
