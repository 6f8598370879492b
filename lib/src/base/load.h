#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace covol::detail {

/// The number stored at `data`. @param swap  whether its byte order differs from this machine's
template <typename T>
[[nodiscard]] T load(const char* data, bool swap) {
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), data, sizeof(T));
    if (swap) std::reverse(bytes.begin(), bytes.end());
    return std::bit_cast<T>(bytes);
}

}  // namespace covol::detail
