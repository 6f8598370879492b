#include "covol/safe_text.h"

#include <cstdio>

namespace covol {
namespace {

struct Character {
    char32_t code = 0;
    std::size_t length = 0;  ///< bytes; 0: no UTF-8
};

/// The first character of a text that is not empty.
Character first_of(std::string_view text) {
    const auto byte = [&](std::size_t n) { return static_cast<unsigned char>(text[n]); };
    if (byte(0) < 0x80) return {byte(0), 1};
    const std::size_t length = byte(0) >= 0xF0 ? 4 : byte(0) >= 0xE0 ? 3 : 2;
    constexpr char32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};  // shorter forms of the same character are refused
    if (byte(0) < 0xC2 || byte(0) > 0xF4 || text.size() < length) return {};
    char32_t code = byte(0) & (0x7FU >> length);
    for (std::size_t n = 1; n < length; ++n) {
        if ((byte(n) & 0xC0U) != 0x80U) return {};
        code = code << 6U | (byte(n) & 0x3FU);
    }
    const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
    if (code < kLeast[length] || code > 0x10FFFF || surrogate) return {};
    return {code, length};
}

bool steers(char32_t code) {
    const bool control = code < 0x20 || (code >= 0x7F && code < 0xA0);
    const bool line_end = code == 0x2028 || code == 0x2029;
    // Unicode's Bidi_Control.
    const bool direction = code == 0x061C || code == 0x200E || code == 0x200F || (code >= 0x202A && code <= 0x202E) ||
                           (code >= 0x2066 && code <= 0x2069);
    return control || line_end || direction;
}

std::string safe(std::string_view text, bool with_line_ends) {
    std::string result;
    result.reserve(text.size());
    while (!text.empty()) {
        const auto [code, length] = first_of(text);
        const std::size_t taken = length == 0 ? 1 : length;
        if (length > 0 && (!steers(code) || (with_line_ends && code == '\n'))) {
            result += text.substr(0, taken);
        } else {
            char number[16];
            std::snprintf(number, sizeof number, length == 0 ? "\\x%02x" : "\\u%04x",
                          length == 0 ? unsigned(static_cast<unsigned char>(text[0])) : unsigned(code));
            result += number;
        }
        text.remove_prefix(taken);
    }
    return result;
}

}  // namespace

std::string safe_text(std::string_view text) { return safe(text, false); }

std::string safe_lines(std::string_view text) { return safe(text, true); }

}  // namespace covol
