#pragma once
#include <array>
#include <charconv>
#include <string>

namespace covol::detail {

/// The shortest decimal text from which this number can be read back exactly; -0 becomes "0".
inline std::string shortest(double value) {
    std::array<char, 32> text{};
    return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value == 0 ? 0.0 : value).ptr};
}

}  // namespace covol::detail
