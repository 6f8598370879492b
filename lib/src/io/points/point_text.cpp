#include "io/points/point_text.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "covol/error.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {
namespace {

using std::string_view;

unsigned byte_of(string_view text, std::size_t at) { return static_cast<unsigned char>(text[at]); }

void append_utf8(std::string& text, std::uint32_t code) {
    const auto add = [&](std::uint32_t byte) { text += static_cast<char>(byte); };
    const auto rest = [&](unsigned shift) { add(0x80U | (code >> shift & 0x3FU)); };
    if (code < 0x80) {
        add(code);
    } else if (code < 0x800) {
        add(0xC0U | code >> 6U);
        rest(0);
    } else if (code < 0x10000) {
        add(0xE0U | code >> 12U);
        rest(6);
        rest(0);
    } else {
        add(0xF0U | code >> 18U);
        rest(12);
        rest(6);
        rest(0);
    }
}

/// The index (0 or 1) of the byte that is 0 in more than 90 % of the pairs of bytes while the other byte is never 0.
/// This is so in UTF-16 text of Latin letters and digits. -1 if there is none.
int zero_byte(string_view text) {
    constexpr std::size_t kMaxChecked = 400;
    std::size_t zeros[2] = {0, 0}, pairs = 0;
    for (std::size_t at = 0; at + 1 < std::min(text.size(), kMaxChecked); at += 2, ++pairs)
        for (std::size_t n = 0; n < 2; ++n) zeros[n] += text[at + n] == '\0' ? 1 : 0;
    if (pairs < 4) return -1;
    for (int n = 0; n < 2; ++n)
        if (zeros[n] * 10 > pairs * 9 && zeros[1 - n] == 0) return n;
    return -1;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

void fail(const std::string& path, std::size_t line, const std::string& what) {
    throw Error(Errc::InvalidInput, path + ":" + std::to_string(line) + ": " + what);
}

void fail(const std::string& path, const std::string& what) { throw Error(Errc::InvalidInput, path + ": " + what); }

double to_coordinate(const std::string& path, std::size_t line, std::string_view field) {
    const std::optional<double> value = to_number(field);
    if (!value) fail(path, line, "expected a number, got " + quote(field));
    if (!std::isfinite(*value)) fail(path, line, "expected a finite number, got " + quote(field));
    return *value;
}

std::string to_utf8(string_view text) {
    bool big = false;
    if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
        big = text.front() == '\xFE';
        text.remove_prefix(2);
    } else if (const int zero = zero_byte(text); zero >= 0) {
        big = zero == 0;
    } else {
        return std::string(text);
    }
    const auto unit = [&](std::size_t at) -> std::uint32_t {
        return big ? byte_of(text, at) << 8U | byte_of(text, at + 1) : byte_of(text, at + 1) << 8U | byte_of(text, at);
    };
    std::string result;
    result.reserve(text.size() / 2);
    for (std::size_t at = 0; at + 1 < text.size(); at += 2) {
        std::uint32_t code = unit(at);
        const bool high = code >= 0xD800 && code < 0xDC00;
        if (high && at + 3 < text.size() && unit(at + 2) >= 0xDC00 && unit(at + 2) < 0xE000) {
            code = 0x10000 + ((code - 0xD800) << 10U) + (unit(at + 2) - 0xDC00);
            at += 2;
        }
        append_utf8(result, code);
    }
    return result;
}

std::optional<double> table_number(string_view field) {
    if (const auto plain = to_number(field)) return plain;
    std::string text(field);
    constexpr string_view kMinus = "\xE2\x88\x92";  // U+2212, the minus sign
    if (text.starts_with(kMinus)) text.replace(0, kMinus.size(), "-");
    const std::size_t comma = text.rfind(','), point = text.rfind('.');
    if (comma != std::string::npos) {
        // A comma that no digit follows, as in "1,", separates columns; the field is then not a number.
        const bool between = comma > 0 && comma + 1 < text.size() && is_digit(text[comma + 1]);
        if (!between) return std::nullopt;
        const bool is_decimal = text.find(',') == comma && (point == std::string::npos || point < comma);
        if (!is_decimal && point != std::string::npos && point < comma) return std::nullopt;
        std::erase(text, is_decimal ? '.' : ',');
        std::replace(text.begin(), text.end(), ',', '.');
    }
    return to_number(text);
}

bool begins_with_numbers(const std::vector<string_view>& fields) {
    return fields.size() >= 3 && table_number(fields[0]) && table_number(fields[1]) && table_number(fields[2]);
}

std::string unit_of_length(string_view text) {
    std::string word(trim(text));
    std::erase_if(word, [](char c) { return c == '(' || c == ')' || c == '[' || c == ']' || c == '"'; });
    const std::string unit = normal_unit(word);
    return unit_in_metres(unit) > 0 ? unit : "";
}

}  // namespace covol::detail
