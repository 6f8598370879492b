#include "cloud/surface/blend_kernel.h"

#include <algorithm>
#include <cmath>

#include "base/clones.h"

namespace covol::cloud {
namespace {

using detail::Float8;
using detail::Int8;

COVOL_INLINE Float8& at(float* values, int row) { return reinterpret_cast<Float8*>(values)[row]; }

COVOL_INLINE float square_root(float x) { return __builtin_sqrtf(x); }

COVOL_INLINE Float8 square_root(Float8 x) {
    for (int n = 0; n < 8; ++n) x[n] = __builtin_sqrtf(x[n]);
    return x;
}

/// Calls visit(i, j, squared distances of the row's voxels from the foot, divided by the squared reach) for each row
/// that the piece reaches.
template <typename Visit>
COVOL_INLINE void for_rows(const BlendPiece& piece, float h, Visit visit) {
    int first[3], last[3];
    for (int a = 0; a < 3; ++a) {
        first[a] = std::max(0, int(std::ceil((piece.foot[a] - piece.reach) / h)));
        last[a] = std::min(7, int(std::floor((piece.foot[a] + piece.reach) / h)));
    }
    if (first[2] > last[2]) return;
    const Float8 z = Float8{0, 1, 2, 3, 4, 5, 6, 7} * h - piece.foot[2], z2 = z * z;
    const float scale = 1 / (piece.reach * piece.reach);
    for (int i = first[0]; i <= last[0]; ++i)
        for (int j = first[1]; j <= last[1]; ++j) {
            const float x = h * float(i) - piece.foot[0], y = h * float(j) - piece.foot[1], beside = x * x + y * y;
            if (beside < piece.reach * piece.reach) visit(i, j, (z2 + beside) * scale);
        }
}

/// First-order distance from a sheet to a position or a row of positions.
template <typename Real>
COVOL_INLINE Real distance_to(const BlendSheet& s, float x, float y, Real z) {
    x -= s.origin[0], y -= s.origin[1], z -= s.origin[2];
    const Real u = s.axes[0][0] * x + s.axes[0][1] * y + s.axes[0][2] * z;
    const Real v = s.axes[1][0] * x + s.axes[1][1] * y + s.axes[1][2] * z;
    const Real t = s.axes[2][0] * x + s.axes[2][1] * y + s.axes[2][2] * z;
    const Real height = s.c[0] + u * (s.c[1] + u * s.c[3] + v * s.c[4]) + v * (s.c[2] + v * s.c[5]);
    const Real du = s.c[1] + 2 * u * s.c[3] + v * s.c[4], dv = s.c[2] + 2 * v * s.c[5] + u * s.c[4];
    return (t - height) / square_root(1 + du * du + dv * dv);
}

template <typename Real>
COVOL_INLINE Real distance_to(const BlendPiece& p, float x, float y, Real z) {
    Real distance = distance_to(p.sheets[p.count - 1], x, y, z);
    for (int n = p.count - 2; n >= 0; --n) {
        const Real other = distance_to(p.sheets[n], x, y, z);
        if (n == 0 ? p.first_is_convex : p.others_are_convex)
            distance = other > distance ? other : distance;
        else
            distance = other > distance ? distance : other;
    }
    return distance;
}

}  // namespace

COVOL_CLONES void blend(const BlendPiece* pieces, std::size_t count, float h, float limit, BlendLeaf& leaf) {
    const Float8 z = Float8{0, 1, 2, 3, 4, 5, 6, 7} * h;
    leaf.fraction.fill(BlendLeaf::kNone);
    leaf.nearest.fill(-1);
    leaf.sum.fill(0);
    leaf.weight.fill(0);
    for (std::size_t n = 0; n < count; ++n) {
        const BlendPiece& p = pieces[n];
        for_rows(
            p, h, [&](int i, int j, const Float8& fraction) __attribute__((always_inline)) {
                const int row = 8 * i + j;
                Float8& minimum = at(leaf.fraction.data(), row);
                Int8& nearest = reinterpret_cast<Int8*>(leaf.nearest.data())[row];
                const Int8 nearer = (fraction < minimum) & (fraction < 1.0F);
                minimum = nearer ? fraction : minimum;
                nearest = nearer ? Int8{} + std::int32_t(n) : nearest;
            });
    }
    // In rows that are far from the surface according to the nearest pieces of their voxels, the other pieces are not
    // evaluated.
    bool is_near[64];
    for (int row = 0; row < 64; ++row) {
        bool any = false;
        for (int k = 0; k < 8; ++k) {
            const std::size_t voxel = std::size_t(row) * 8 + std::size_t(k);
            const std::int32_t nearest = leaf.nearest[voxel];
            for (std::size_t a = 0; a < 3; ++a) leaf.normal[a][voxel] = nearest < 0 ? 0.0F : pieces[nearest].normal[a];
            if (nearest < 0) continue;
            const float distance = distance_to(pieces[nearest], h * float(row >> 3), h * float(row & 7), h * float(k));
            any |= std::abs(distance) < limit;
            leaf.sum[voxel] = distance;
            leaf.weight[voxel] = 1;
        }
        is_near[row] = any;
        if (any) at(leaf.sum.data(), row) = at(leaf.weight.data(), row) = Float8{};
    }
    for (std::size_t n = 0; n < count; ++n) {
        const BlendPiece& p = pieces[n];
        for_rows(
            p, h, [&](int i, int j, const Float8& fraction) __attribute__((always_inline)) {
                const int row = 8 * i + j;
                if (!is_near[row]) return;
                const Float8 same = at(leaf.normal[0].data(), row) * p.normal[0] +
                                    at(leaf.normal[1].data(), row) * p.normal[1] +
                                    at(leaf.normal[2].data(), row) * p.normal[2];
                const Int8 counts = (fraction < 1.0F) & (same > 0.0F);
                if (!detail::any(counts)) return;
                const Float8 near = 1 - fraction, weight = counts ? near * near : Float8{};
                at(leaf.sum.data(), row) += weight * distance_to(p, h * float(i), h * float(j), z);
                at(leaf.weight.data(), row) += weight;
            });
    }
}

}  // namespace covol::cloud
