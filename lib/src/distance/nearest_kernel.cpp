#include "distance/nearest_kernel.h"

#include <cstring>

#include "base/clones.h"

namespace covol::detail {
namespace {

/// The nearest known point of each of eight voxels in a row along k.
struct Points8 {
    Float8 x, y, z;
    Int8 index;
};

COVOL_INLINE Points8 load_points(const NearestBlock& b, int at) {
    return {load<Float8>(b.x + at), load<Float8>(b.y + at), load<Float8>(b.z + at), load<Int8>(b.index + at)};
}

COVOL_INLINE Points8 broadcast(const NearestBlock& b, int at) {
    const Float8 zero{};
    return {zero + b.x[at], zero + b.y[at], zero + b.z[at], Int8{} + b.index[at]};
}

/// A row of voxels with their points and squared distances.
struct Row {
    Float8 i, j, k;
    Points8 p;
    Float8 squared;

    [[nodiscard]] COVOL_INLINE Float8 distance_to(const Points8& q) const {
        const Float8 dx = q.x - i, dy = q.y - j, dz = q.z - k;
        return dx * dx + dy * dy + dz * dz;
    }
    COVOL_INLINE Row(const NearestBlock& b, int at_i, int at_j)
        : i(Float8{} + float(at_i)),
          j(Float8{} + float(at_j)),
          k{0, 1, 2, 3, 4, 5, 6, 7},
          p(load_points(b, NearestBlock::offset(at_i, at_j, 0))),
          squared(distance_to(p)) {}
    COVOL_INLINE void offer(const Points8& q) {
        const Float8 s = distance_to(q);
        const Int8 nearer = s < squared;
        p.x = nearer ? q.x : p.x;
        p.y = nearer ? q.y : p.y;
        p.z = nearer ? q.z : p.z;
        p.index = nearer ? q.index : p.index;
        squared = nearer ? s : squared;
    }
    COVOL_INLINE void store(NearestBlock& b, int at) const {
        std::memcpy(b.x + at, &p.x, sizeof p.x);
        std::memcpy(b.y + at, &p.y, sizeof p.y);
        std::memcpy(b.z + at, &p.z, sizeof p.z);
        std::memcpy(b.index + at, &p.index, sizeof p.index);
    }
};

// The points of a row, moved by N voxels to higher or lower k. The N voxels at the end get the halo's point, although
// it is not N voxels away from all of them: any point may be offered to any voxel, because offer() compares distances.
template <int N>
COVOL_INLINE Points8 moved_up(const Points8& p, const Points8& halo) {
    const auto shift = [](const auto& v, const auto& h) __attribute__((always_inline)) {
        return __builtin_shufflevector(h, v, 8 - N, 9 - N, 10 - N, 11 - N, 12 - N, 13 - N, 14 - N, 15 - N);
    };
    return {shift(p.x, halo.x), shift(p.y, halo.y), shift(p.z, halo.z), shift(p.index, halo.index)};
}
template <int N>
COVOL_INLINE Points8 moved_down(const Points8& p, const Points8& halo) {
    const auto shift = [](const auto& v, const auto& h) __attribute__((always_inline)) {
        return __builtin_shufflevector(v, h, N, N + 1, N + 2, N + 3, N + 4, N + 5, N + 6, N + 7);
    };
    return {shift(p.x, halo.x), shift(p.y, halo.y), shift(p.z, halo.z), shift(p.index, halo.index)};
}

/// Passes points along the row in both directions, in steps of 1, 2 and 4 voxels instead of seven steps of one.
COVOL_INLINE void sweep_row(Row& row, const NearestBlock& b, int at) {
    const Points8 below = broadcast(b, at - 1);
    row.offer(moved_up<1>(row.p, below));
    row.offer(moved_up<2>(row.p, below));
    row.offer(moved_up<4>(row.p, below));
    const Points8 above = broadcast(b, at + 8);
    row.offer(moved_down<1>(row.p, above));
    row.offer(moved_down<2>(row.p, above));
    row.offer(moved_down<4>(row.p, above));
}

COVOL_INLINE void sweep_slice(NearestBlock& b, int i, int from) {
    for (int j = 0; j < 8; ++j) {
        Row row(b, i, j);
        const int at = NearestBlock::offset(from, j, 0);
        row.offer(load_points(b, at));
        row.offer(load_points(b, at - NearestBlock::kRow));
        row.offer(load_points(b, at + NearestBlock::kRow));
        row.offer(load_points(b, at - 1));
        row.offer(load_points(b, at + 1));
        row.offer(load_points(b, at - NearestBlock::kRow - 1));
        row.offer(load_points(b, at - NearestBlock::kRow + 1));
        row.offer(load_points(b, at + NearestBlock::kRow - 1));
        row.offer(load_points(b, at + NearestBlock::kRow + 1));
        row.store(b, NearestBlock::offset(i, j, 0));
    }
    Points8 previous = load_points(b, NearestBlock::offset(i, -1, 0));
    for (int j = 0; j < 8; ++j) {
        Row row(b, i, j);
        const int at = NearestBlock::offset(i, j, 0);
        row.offer(previous);
        sweep_row(row, b, at);
        row.store(b, at);
        previous = row.p;
    }
    previous = load_points(b, NearestBlock::offset(i, 8, 0));
    for (int j = 7; j >= 0; --j) {
        Row row(b, i, j);
        const int at = NearestBlock::offset(i, j, 0);
        row.offer(previous);
        row.store(b, at);
        previous = row.p;
    }
}

/// The points of eight voxels whose offsets in the block differ by `stride`.
COVOL_INLINE Points8 load_points(const NearestBlock& b, int at, int stride) {
    Points8 p;
    for (int n = 0; n < 8; ++n) {
        p.x[n] = b.x[at + n * stride];
        p.y[n] = b.y[at + n * stride];
        p.z[n] = b.z[at + n * stride];
        p.index[n] = b.index[at + n * stride];
    }
    return p;
}

/// Whether a voxel of the halo layer beyond a face would take a point, within reach, from the face's voxels. `normal`
/// points from the face to the halo, `row` along the eight rows, `along` along the eight voxels of a row.
COVOL_INLINE bool face_improves(const NearestBlock& b, float reach, const int (&normal)[3], const int (&row)[3],
                                const int (&along)[3]) {
    constexpr int kStride[3] = {NearestBlock::kSlice, NearestBlock::kRow, 1};
    const auto stride = [&](const int(&v)[3]) { return v[0] * kStride[0] + v[1] * kStride[1] + v[2] * kStride[2]; };
    const int outward = stride(normal), next_row = stride(row), next = stride(along);
    const Float8 lanes{0, 1, 2, 3, 4, 5, 6, 7};
    Int8 improved{};
    for (int r = 0; r < 8; ++r) {
        int at[3];  // the first voxel of the row, in the halo
        for (int a = 0; a < 3; ++a) at[a] = (normal[a] > 0 ? 8 : normal[a] < 0 ? -1 : 0) + r * row[a];
        const int offset = NearestBlock::offset(at[0], at[1], at[2]);
        Row halo(b, 0, 0);
        halo.i = lanes * float(along[0]) + float(at[0]);
        halo.j = lanes * float(along[1]) + float(at[1]);
        halo.k = lanes * float(along[2]) + float(at[2]);
        const Float8 known = halo.distance_to(load_points(b, offset, next));
        for (int n = -1; n <= 1; ++n) {
            const Float8 s = halo.distance_to(load_points(b, offset - outward + n * next_row, next));
            improved |= (s < known) & (s <= reach);
        }
    }
    return any(improved);
}

}  // namespace

COVOL_CLONES unsigned improved_faces(const NearestBlock& b, float reach) {
    constexpr int kI[3] = {1, 0, 0}, kJ[3] = {0, 1, 0}, kK[3] = {0, 0, 1};
    constexpr int kDown[3][3] = {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
    return unsigned(face_improves(b, reach, kDown[0], kJ, kK)) | unsigned(face_improves(b, reach, kI, kJ, kK)) << 1 |
           unsigned(face_improves(b, reach, kDown[1], kI, kK)) << 2 |
           unsigned(face_improves(b, reach, kJ, kI, kK)) << 3 |
           unsigned(face_improves(b, reach, kDown[2], kI, kJ)) << 4 |
           unsigned(face_improves(b, reach, kK, kI, kJ)) << 5;
}

COVOL_CLONES void sweep_nearest(NearestBlock& block) {
    for (int i = 0; i < 8; ++i) sweep_slice(block, i, i - 1);
    for (int i = 7; i >= 0; --i) sweep_slice(block, i, i + 1);
}

COVOL_CLONES void store_points(const NearestBlock& block, float reach, bool all, std::int32_t* nearest,
                               std::uint64_t* changed) {
    const Int8 bit = {1, 2, 4, 8, 16, 32, 64, 128}, report_all = Int8{} - int(all);
    for (int i = 0; i < 8; ++i) {
        changed[i] = 0;
        for (int j = 0; j < 8; ++j) {
            const Row row(block, i, j);
            std::int32_t* to = nearest + (i * 8 + j) * 8;
            const Int8 improved = (row.squared <= reach) & (report_all | (row.p.index != load<Int8>(to))) & bit;
            std::uint64_t bits = 0;
            for (int k = 0; k < 8; ++k) bits |= std::uint64_t(improved[k]);
            changed[i] |= bits << (8 * j);
            std::memcpy(to, &row.p.index, sizeof row.p.index);
        }
    }
}

COVOL_CLONES void squared_distances(const NearestBlock& block, float* squared) {
    for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j) {
            const Row row(block, i, j);
            std::memcpy(squared + (i * 8 + j) * 8, &row.squared, sizeof row.squared);
        }
}

}  // namespace covol::detail
