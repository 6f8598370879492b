#pragma once
#include <cstddef>
#include <vector>

namespace covol::detail {

/// What std::nth_element() would put at place n, on all threads; `values` stay as they are.
/// @param values  none that is not a number
/// @param n       below their count
[[nodiscard]] float nth_value(const std::vector<float>& values, std::size_t n);

}  // namespace covol::detail
