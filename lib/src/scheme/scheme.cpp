#include "scheme/scheme.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace covol::detail {

namespace baseline {
extern const SchemeKernels kKernels;
}
#ifdef COVOL_X86
namespace avx2 {
extern const SchemeKernels kKernels;
}
namespace avx512 {
extern const SchemeKernels kKernels;
}
#endif

namespace {

constexpr int kLeafSize = 512;

const SchemeKernels& choose() {
    const std::vector<const SchemeKernels*> available = available_kernels();
    const char* requested = std::getenv("COVOL_SIMD");
    for (const SchemeKernels* set : available)
        if (requested != nullptr && std::strcmp(set->name, requested) == 0) return *set;
    return *available.back();
}

}  // namespace

std::vector<const SchemeKernels*> available_kernels() {
    std::vector<const SchemeKernels*> sets = {&baseline::kKernels};
#ifdef COVOL_X86
    const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    if (has_avx2) sets.push_back(&avx2::kKernels);
    if (has_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw"))
        sets.push_back(&avx512::kKernels);
#endif
    return sets;
}

const SchemeKernels& kernels() {
    static const SchemeKernels& chosen = choose();
    return chosen;
}

// Planes are copied first, then rows, then voxels: a voxel outside along two axes gets the value of a voxel that is
// itself a copy.
void mirror_outside(float* values, const int lo[3], const int hi[3]) {
    for (int i = -1; i <= 8; ++i)
        if (const int from = std::clamp(i, lo[0], hi[0]); from != i)
            std::memcpy(values + padded(i, -1, -4), values + padded(from, -1, -4), 10 * kRow * sizeof(float));
    for (int j = -1; j <= 8; ++j)
        if (const int from = std::clamp(j, lo[1], hi[1]); from != j)
            for (int i = -1; i <= 8; ++i)
                std::memcpy(values + padded(i, j, -4), values + padded(i, from, -4), kRow * sizeof(float));
    for (int k = -1; k <= 8; ++k)
        if (const int from = std::clamp(k, lo[2], hi[2]); from != k)
            for (int i = -1; i <= 8; ++i)
                for (int j = -1; j <= 8; ++j) values[padded(i, j, k)] = values[padded(i, j, from)];
}

void close_faces(Fraction* c, const int lo[3], const int hi[3]) {
    const auto is_inner = [&](int axis, int at) { return at > lo[axis] && at < hi[axis]; };
    const bool inner_k = lo[2] < 0 && hi[2] > 7;
    for (int n = 0; n < kLeafSize; ++n) {
        const int at[3] = {n >> 6, (n >> 3) & 7, n & 7};
        if (inner_k && is_inner(0, at[0]) && is_inner(1, at[1])) {
            n += 7;  // skips the row, which has no face on the boundary
            continue;
        }
        bool outside = false;
        int closed = 0;
        for (int axis = 0; axis < 3; ++axis) {
            outside |= at[axis] < lo[axis] || at[axis] > hi[axis];
            if (at[axis] == lo[axis]) closed += std::exchange(c[fraction_at(2 * axis, n)], Fraction{0});
            if (at[axis] == hi[axis]) closed += std::exchange(c[fraction_at(2 * axis + 1, n)], Fraction{0});
        }
        // c = a / (1 + S), where S is the sum of a over the six faces. Without the closed faces, whose sum is x, it
        // becomes a / (1 + S - x) = c / (1 - closed), where closed = x / (1 + S).
        const double scale = outside                  ? 0.0
                             : closed < kFractionUnit ? 1.0 / (1.0 - double(closed) / kFractionUnit)
                                                      : 1.0;
        if (scale != 1.0)
            for (int f = 0; f < 6; ++f) {
                Fraction& fraction = c[fraction_at(f, n)];
                fraction = static_cast<Fraction>(std::min(fraction * scale + 0.5, double(kFractionUnit)));
            }
    }
}

}  // namespace covol::detail
