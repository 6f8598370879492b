#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

namespace covol::cloud {

/// The upper one of two; 0 of none.
template <typename T>
T median(std::vector<T> values) {
    if (values.empty()) return T{};
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace covol::cloud
