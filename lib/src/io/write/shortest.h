#pragma once
#include <array>
#include <charconv>
#include <string>

namespace covol::detail {

/// The shortest text that represents this number exactly; zero has no sign.
inline std::string shortest(double value) {
    std::array<char, 32> text{};
    return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value == 0 ? 0.0 : value).ptr};
}

}  // namespace covol::detail
