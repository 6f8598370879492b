#include "cloud/poisson/block_kernel.h"

#include <cstring>

#include "base/clones.h"

namespace covol::cloud {
namespace {

using detail::Float8;
using detail::Int8;

COVOL_INLINE Float8 neighbours(const float* p) {
    return detail::load<Float8>(p - 100) + detail::load<Float8>(p + 100) + detail::load<Float8>(p - 10) +
           detail::load<Float8>(p + 10) + detail::load<Float8>(p - 1) + detail::load<Float8>(p + 1);
}

/// Calls visit(index of the row's first value in the padded block, index of its first node in the block, parity of
/// i + j) for each row of eight nodes.
template <typename Visit>
COVOL_INLINE void for_rows(Visit visit) {
    for (std::size_t i = 0; i < 8; ++i)
        for (std::size_t j = 0; j < 8; ++j) visit((i + 1) * 100 + (j + 1) * 10 + 1, i * 64 + j * 8, (i + j) & 1);
}

}  // namespace

COVOL_CLONES void sweep_block(float* padded, const float* right, const float* screen) {
    const Int8 even = {-1, 0, -1, 0, -1, 0, -1, 0};
    for (std::size_t colour = 0; colour < 2; ++colour)
        for_rows([&](std::size_t row, std::size_t at, std::size_t parity) {
            float* p = padded + row;
            const Float8 sum = detail::load<Float8>(right + at) + neighbours(p);
            const Float8 now =
                screen == nullptr ? sum * (1.0F / 6.0F) : sum / (6.0F + detail::load<Float8>(screen + at));
            const Int8 kept = parity == colour ? even : ~even;
            const Float8 both = kept ? now : detail::load<Float8>(p);
            std::memcpy(p, &both, sizeof both);
        });
}

COVOL_CLONES void residual_block(const float* padded, const float* right, const float* screen, float* residual) {
    for_rows([&](std::size_t row, std::size_t at, std::size_t) {
        const float* p = padded + row;
        Float8 diagonal = 6.0F * detail::load<Float8>(p);
        if (screen != nullptr) diagonal = (6.0F + detail::load<Float8>(screen + at)) * detail::load<Float8>(p);
        const Float8 left = detail::load<Float8>(right + at) + neighbours(p) - diagonal;
        std::memcpy(residual + at, &left, sizeof left);
    });
}

COVOL_CLONES void prolong_block(const float* coarse, float* fine) {
    float along[5][5][8], plane[5][64];
    for (int i = 0; i < 5; ++i)
        for (int j = 0; j < 5; ++j)
            for (int k = 0; k < 4; ++k) {
                const float* p = coarse + i * 25 + j * 5 + k;
                along[i][j][2 * k] = p[0];
                along[i][j][2 * k + 1] = 0.5F * (p[0] + p[1]);
            }
    for (int i = 0; i < 5; ++i)
        for (int j = 0; j < 4; ++j)
            for (int k = 0; k < 8; ++k) {
                plane[i][16 * j + k] = along[i][j][k];
                plane[i][16 * j + 8 + k] = 0.5F * (along[i][j][k] + along[i][j + 1][k]);
            }
    for (int i = 0; i < 4; ++i)
        for (int jk = 0; jk < 64; ++jk) {
            const float here = plane[i][jk], next = plane[i + 1][jk];
            fine[i * 128 + jk] += here;
            fine[i * 128 + 64 + jk] += 0.5F * (here + next);
        }
}

COVOL_CLONES void restrict_block(const float* fine, float* coarse) {
    float planes[4][81], rows[4][4][9];
    for (int i = 0; i < 4; ++i)
        for (int jk = 0; jk < 81; ++jk) {
            const float* p = fine + (2 * i) * 81 + jk;
            planes[i][jk] = 0.5F * (p[0] + p[162]) + p[81];
        }
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            for (int k = 0; k < 9; ++k) {
                const float* p = planes[i] + 2 * j * 9 + k;
                rows[i][j][k] = 0.5F * (p[0] + p[18]) + p[9];
            }
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            for (int k = 0; k < 4; ++k)
                coarse[i * 16 + j * 4 + k] = 0.5F * (rows[i][j][2 * k] + rows[i][j][2 * k + 2]) + rows[i][j][2 * k + 1];
}

}  // namespace covol::cloud
