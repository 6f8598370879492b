#pragma once
// Sums over the levels of brightness in profiles, eight at a time.
#include <cstddef>

namespace covol::guidance {

/// Σ a b. @param count  a multiple of 8
[[nodiscard]] float sum_of_products(const float* a, const float* b, std::size_t count);

}  // namespace covol::guidance
