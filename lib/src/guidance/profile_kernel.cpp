#include "guidance/profile_kernel.h"

#include <cstring>

#include "base/clones.h"

namespace covol::guidance {
namespace {

using detail::Float8;

COVOL_INLINE Float8 load(const float* from) {
    Float8 v;
    std::memcpy(&v, from, sizeof v);
    return v;
}

}  // namespace

COVOL_CLONES float sum_of_products(const float* a, const float* b, std::size_t count) {
    Float8 even{}, odd{};
    std::size_t n = 0;
    for (; n + 16 <= count; n += 16) {
        even += load(a + n) * load(b + n);
        odd += load(a + n + 8) * load(b + n + 8);
    }
    if (n < count) even += load(a + n) * load(b + n);
    const Float8 v = even + odd;
    return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

COVOL_CLONES void add_weighted(double* sums, const double* values, double weight, std::size_t count) {
    for (std::size_t n = 0; n < count; ++n) sums[n] += weight * values[n];
}

COVOL_CLONES void convolve(const float* line, const float* kernel, std::size_t taps, float* out, std::size_t count) {
    std::size_t n = 0;
    for (; n + 8 <= count; n += 8) {
        Float8 sum{};
        for (std::size_t k = 0; k < taps; ++k) sum += kernel[k] * load(line + n + k);
        std::memcpy(out + n, &sum, sizeof sum);
    }
    for (; n < count; ++n) {
        float sum = 0;
        for (std::size_t k = 0; k < taps; ++k) sum += kernel[k] * line[n + k];
        out[n] = sum;
    }
}

}  // namespace covol::guidance
