#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

namespace covol::cloud {

/// The median: the upper of the two middle values if the number of values is even, 0 if there are none.
template <typename T>
T median(std::vector<T> values) {
    if (values.empty()) return T{};
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace covol::cloud
