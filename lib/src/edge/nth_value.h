#pragma once
#include <cstddef>
#include <vector>

namespace covol::detail {

/// The value that std::nth_element() would put at position n, in parallel; `values` are not changed.
/// @param values  without NaN
/// @param n       less than the number of values
[[nodiscard]] float nth_value(const std::vector<float>& values, std::size_t n);

}  // namespace covol::detail
