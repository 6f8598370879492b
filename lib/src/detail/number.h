#pragma once
#include <sstream>
#include <string>

namespace covol::detail {

/// A number as messages show it: six digits.
inline std::string number(double value) {
    std::ostringstream text;
    text << value;
    return text.str();
}

}  // namespace covol::detail
