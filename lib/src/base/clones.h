#pragma once
#include <cstdint>

// Functions on eight floats that are compiled twice, without and with AVX2, and chosen at run time. Fused multiply-add
// is not used, so both give bitwise equal results. The functions that they call have to be inlined.

// GCC warns that vectors are passed to functions differently with and without AVX. This does not matter here, because
// vectors are only passed to functions that are inlined.
#pragma GCC diagnostic ignored "-Wpsabi"

// With the thread sanitizer, only one version is compiled: the sanitizer would instrument the functions that choose a
// version, which run before it is initialized.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_THREAD__)
#define COVOL_CLONES __attribute__((target_clones("default", "avx2")))
#else
#define COVOL_CLONES
#endif
#define COVOL_INLINE inline __attribute__((always_inline))

namespace covol::detail {

using Float8 = float __attribute__((vector_size(32)));
using Int8 = std::int32_t __attribute__((vector_size(32)));

/// Loads from an address of any alignment.
template <typename Vector, typename T>
COVOL_INLINE Vector load(const T* from) {
    Vector v;
    __builtin_memcpy(&v, from, sizeof v);
    return v;
}

COVOL_INLINE bool any(Int8 mask) {
    using Long4 = std::int64_t __attribute__((vector_size(32)));
    const Long4 m = (Long4)mask;
    return ((m[0] | m[1]) | (m[2] | m[3])) != 0;
}

}  // namespace covol::detail
