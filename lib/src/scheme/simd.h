#pragma once
// Vectors of 8 floats by the compiler's vector extension: one source for SSE2, AVX2, AVX-512 and other processors.
// Only for files that are compiled for one instruction set each: everything here has internal linkage.

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace covol::detail {
namespace {

// NOLINTBEGIN(modernize-use-using): attributes of vectors bind to a typedef
typedef float Lanes __attribute__((vector_size(32)));                              // 8 floats
typedef float LooseLanes __attribute__((vector_size(32), aligned(4), may_alias));  // not necessarily aligned
typedef unsigned short LooseShorts __attribute__((vector_size(16), aligned(2), may_alias));
typedef int LaneBits __attribute__((vector_size(32)));
typedef unsigned UnsignedLanes __attribute__((vector_size(32)));
// NOLINTEND(modernize-use-using)

inline Lanes load(const float* p) { return *reinterpret_cast<const LooseLanes*>(p); }
inline void store(float* p, Lanes v) { *reinterpret_cast<LooseLanes*>(p) = v; }
/// Eight 16-bit integers, 0 to 65535, as floats.
inline Lanes load_fractions(const unsigned short* p) {
#if defined(__AVX2__)
    const LaneBits whole = (LaneBits)_mm256_cvtepu16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
#else
    const LaneBits whole = __builtin_convertvector(*reinterpret_cast<const LooseShorts*>(p), LaneBits);
#endif
    return __builtin_convertvector(whole, Lanes);
}
inline void store(unsigned short* p, LaneBits v) {
    *reinterpret_cast<LooseShorts*>(p) = __builtin_convertvector(v, LooseShorts);
}
/// Lane k is v[k-1]; lane 0 is edge[0].
inline Lanes shifted_up(Lanes v, Lanes edge) { return __builtin_shufflevector(v, edge, 8, 0, 1, 2, 3, 4, 5, 6); }
/// Lane k is v[k+1]; lane 7 is edge[7].
inline Lanes shifted_down(Lanes v, Lanes edge) { return __builtin_shufflevector(v, edge, 1, 2, 3, 4, 5, 6, 7, 15); }
inline Lanes broadcast(float x) { return Lanes{} + x; }
inline Lanes max(Lanes a, Lanes b) { return a > b ? a : b; }
inline Lanes min(Lanes a, Lanes b) { return a < b ? a : b; }
inline bool any(LaneBits mask) {
#if defined(__AVX__)
    return _mm256_movemask_ps((__m256)mask) != 0;
#else
    int bits = 0;
    for (int k = 0; k < 8; ++k) bits |= mask[k];
    return bits != 0;
#endif
}
/// Eight floats, `stride` apart.
inline Lanes load_strided(const float* p, int stride) {
    return Lanes{p[0],          p[stride],     p[2 * stride], p[3 * stride],
                 p[4 * stride], p[5 * stride], p[6 * stride], p[7 * stride]};
}
inline float sum(Lanes v) { return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7])); }
inline float largest(Lanes v) {
    float m = v[0];
    for (int k = 1; k < 8; ++k) m = v[k] > m ? v[k] : m;
    return m;
}

/// 1/√x for x > 0, with a relative error of about 1e-7: the processor's estimate and one step of Newton's method.
inline Lanes inverse_sqrt(Lanes x) {
#if defined(__AVX512VL__)
    const Lanes y = (Lanes)_mm256_rsqrt14_ps((__m256)x);
#elif defined(__AVX__)
    const Lanes y = (Lanes)_mm256_rsqrt_ps((__m256)x);
#elif defined(__SSE2__)
    union {
        Lanes whole;
        __m128 half[2];
    } in = {x}, out;
    out.half[0] = _mm_rsqrt_ps(in.half[0]);
    out.half[1] = _mm_rsqrt_ps(in.half[1]);
    const Lanes y = out.whole;
#else
    Lanes y;
    for (int k = 0; k < 8; ++k) y[k] = 1.0F / __builtin_sqrtf(x[k]);
    return y;
#endif
    return y * (1.5F - 0.5F * x * y * y);
}

}  // namespace
}  // namespace covol::detail
