#pragma once
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "grid/leaf_band.h"
#include "grid/leaf_propagation.h"

namespace covol::detail {

/// Bit n: the n-th of 64 values is below zero.
inline std::uint64_t negative_slice(const float* v) {
    std::uint64_t bits = 0;
#if defined(__SSE2__)
    for (int n = 0; n < 64; n += 4) {
        const __m128 below = _mm_cmplt_ps(_mm_loadu_ps(v + n), _mm_setzero_ps());
        bits |= std::uint64_t(_mm_movemask_ps(below)) << n;
    }
#else
    for (int n = 0; n < 64; ++n) bits |= std::uint64_t(v[n] < 0.0F) << n;
#endif
    return bits;
}

/// The voxels of a leaf with values below zero.
inline LeafMask negative_mask(const float* values) {
    LeafMask mask;
    for (int word = 0; word < 8; ++word) mask[word] = negative_slice(values + 64 * word);
    return mask;
}

/// Voxels whose next voxel along an axis, within the leaf, has the other sign.
inline LeafMask sign_changes(const LeafMask& negative, int axis) {
    constexpr LeafMask kRest{};
    LeafMask changes = beside_marked(negative, kRest, axis, 1);
    for (int word = 0; word < 8; ++word) changes[word] ^= negative[word];
    // The last voxels along the axis have no next one in the leaf.
    if (axis == 0) changes[7] = 0;
    for (std::uint64_t& word : changes)
        word &= axis == 1 ? ~std::uint64_t(0) >> 8 : axis == 2 ? 0x7f7f7f7f7f7f7f7fULL : ~0ULL;
    return changes;
}

/// The same for pairs of voxels that are both among the given ones.
inline LeafMask sign_changes(const LeafMask& negative, const LeafMask& among, int axis) {
    LeafMask changes = sign_changes(negative, axis);
    const LeafMask next = beside_marked(among, LeafMask{}, axis, 1);
    for (int word = 0; word < 8; ++word) changes[word] &= among[word] & next[word];
    return changes;
}

}  // namespace covol::detail
