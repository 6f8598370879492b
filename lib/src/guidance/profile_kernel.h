#pragma once
// Vectorised arithmetic for profiles and the image around them, eight values at a time.
#include <cstddef>

namespace covol::guidance {

/// Sum of a[n] b[n] over n < count. @param count  a multiple of 8
[[nodiscard]] float sum_of_products(const float* a, const float* b, std::size_t count);

/// sums += weight * values
void add_weighted(double* sums, const double* values, double weight, std::size_t count);

/// out[n] = Σ_k kernel[k] line[n + k], k < taps; out must not overlap the inputs.
void convolve(const float* line, const float* kernel, std::size_t taps, float* out, std::size_t count);

}  // namespace covol::guidance
