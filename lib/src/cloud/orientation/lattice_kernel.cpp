#include "cloud/orientation/lattice_kernel.h"

#include <cstring>

#include "base/clones.h"

namespace covol::cloud {
namespace {

using detail::Float8;
using detail::Int8;

COVOL_INLINE float neighbours(const float* u, RowStrides s) {
    return u[-s.i] + u[s.i] + u[-s.j] + u[s.j] + u[-1] + u[1];
}

COVOL_INLINE Float8 load(const float* p) {
    Float8 v;
    std::memcpy(&v, p, sizeof v);
    return v;
}

/// Eight at once are computed and every second one is kept: these do not look at each other.
template <bool kScreened>
COVOL_INLINE void sweep(float* u, const float* right, const float* screen, RowStrides s, std::size_t count,
                        std::size_t first) {
    const std::int32_t even = first == 0 ? -1 : 0, odd = ~even;
    const Int8 kept = {even, odd, even, odd, even, odd, even, odd};
    std::size_t k = 0;
    for (; k + 8 <= count; k += 8) {
        float* p = u + k;
        const Float8 sum =
            load(right + k) + load(p - s.i) + load(p + s.i) + load(p - s.j) + load(p + s.j) + load(p - 1) + load(p + 1);
        const Float8 now = kScreened ? sum / (6.0F + load(screen + k)) : sum * (1.0F / 6.0F);
        const Float8 both = kept ? now : load(p);
        std::memcpy(p, &both, sizeof both);
    }
    for (k += (k + first) & 1; k < count; k += 2)
        u[k] = (right[k] + neighbours(u + k, s)) / (kScreened ? 6 + screen[k] : 6.0F);
}

}  // namespace

COVOL_CLONES void sweep_row(float* u, const float* right, const float* screen, RowStrides strides, std::size_t count,
                            std::size_t first) {
    if (screen == nullptr)
        sweep<false>(u, right, screen, strides, count, first);
    else
        sweep<true>(u, right, screen, strides, count, first);
}

COVOL_CLONES void residual_row(const float* u, const float* right, const float* screen, RowStrides strides,
                               std::size_t count, float* __restrict residual) {
    if (screen == nullptr)
        for (std::size_t k = 0; k < count; ++k) residual[k] = right[k] + neighbours(u + k, strides) - 6.0F * u[k];
    else
        for (std::size_t k = 0; k < count; ++k)
            residual[k] = right[k] + neighbours(u + k, strides) - (6.0F + screen[k]) * u[k];
}

COVOL_CLONES void restrict_row(const float* fine, RowStrides s, std::size_t count, float* __restrict out) {
    for (std::size_t k = 0; k < count; ++k) {
        const float* p = fine + k;
        out[k] = 0.25F * ((p[-s.i - s.j] + p[-s.i + s.j]) + (p[s.i - s.j] + p[s.i + s.j])) +
                 0.5F * ((p[-s.i] + p[s.i]) + (p[-s.j] + p[s.j])) + p[0];
    }
}

COVOL_CLONES void smooth_row(const float* from, std::ptrdiff_t stride, std::size_t count, float* __restrict out) {
    for (std::size_t k = 0; k < count; ++k)
        out[k] = 0.5F * from[k] + 0.25F * (from[std::ptrdiff_t(k) - stride] + from[std::ptrdiff_t(k) + stride]);
}

}  // namespace covol::cloud
