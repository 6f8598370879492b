#pragma once
#include <sstream>
#include <string>

#include "covol/fwd.h"

namespace covol::detail {

/// Rounds down. Faster than floor(), which is a function call if the code is compiled for an instruction set without
/// rounding. @pre |x| < 2^31
inline int round_down(double x) {
    const int i = int(x);
    return i - (double(i) > x);
}

/// A number for messages, with six significant digits.
inline std::string number(double value) {
    std::ostringstream text;
    text << value;
    return text.str();
}

/// A position for messages.
inline std::string to_text(const Vec3& p) {
    return "(" + number(p[0]) + ", " + number(p[1]) + ", " + number(p[2]) + ")";
}

}  // namespace covol::detail
