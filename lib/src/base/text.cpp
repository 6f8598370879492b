#include "base/text.h"

#include <algorithm>
#include <cstdio>

#include "covol/safe_text.h"

namespace covol::detail {

using std::string_view;

string_view trim(string_view text) {
    while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
    return text;
}

std::string lower(string_view text) {
    std::string result(text);
    for (char& c : result)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return result;
}

std::string quote(string_view text) {
    constexpr std::size_t kLongest = 40;
    std::string result = "'";
    for (const char c : text.substr(0, kLongest)) result += static_cast<unsigned char>(c) < 32 ? '?' : c;
    return result + (text.size() > kLongest ? "...'" : "'");
}

Lines::Lines(string_view text) : rest_(text) {
    if (rest_.substr(0, 3) == "\xEF\xBB\xBF") rest_.remove_prefix(3);
    if (rest_.find('\n') == string_view::npos && rest_.find('\r') != string_view::npos) end_ = '\r';
}

bool Lines::next(string_view& line) {
    if (!next_untrimmed(line)) return false;
    line = trim(line);
    return true;
}

bool Lines::next_untrimmed(string_view& line) {
    if (rest_.empty()) return false;
    const std::size_t end = std::min(rest_.find(end_), rest_.size());
    line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    ++number_;
    return true;
}

bool Lines::next_content(string_view& line) {
    while (next(line)) {
        line = trim(line.substr(0, line.find('#')));
        if (!line.empty()) return true;
    }
    return false;
}

bool Lines::next_words(string_view& line, std::vector<string_view>& words) {
    if (!next_content(line)) return false;
    split(line, ' ', words);
    return true;
}

void split(string_view line, char delimiter, std::vector<string_view>& fields) {
    fields.clear();
    if (delimiter == ' ') {
        for (string_view word = next_word(line); !word.empty(); word = next_word(line)) fields.push_back(word);
        return;
    }
    bool quoted = false;
    std::size_t begin = 0;
    const auto add = [&](std::size_t end) {
        string_view field = trim(line.substr(begin, end - begin));
        if (field.size() >= 2 && field.front() == '"' && field.back() == '"')
            field = trim(field.substr(1, field.size() - 2));
        fields.push_back(field);
        begin = end + 1;
    };
    for (std::size_t at = 0; at < line.size(); ++at) {
        if (line[at] == '"') quoted = !quoted;
        if (line[at] == delimiter && !quoted) add(at);
    }
    add(line.size());
}

}  // namespace covol::detail

namespace covol {
namespace {

struct Character {
    char32_t code = 0;
    std::size_t length = 0;  ///< in bytes; 0: invalid UTF-8
};

/// The first character of a text that is not empty.
Character first_of(std::string_view text) {
    const auto byte = [&](std::size_t n) { return static_cast<unsigned char>(text[n]); };
    if (byte(0) < 0x80) return {byte(0), 1};
    const std::size_t length = byte(0) >= 0xF0 ? 4 : byte(0) >= 0xE0 ? 3 : 2;
    // Minimum code point for each length in bytes. Encodings that are longer than necessary are invalid.
    constexpr char32_t kMin[] = {0, 0, 0x80, 0x800, 0x10000};
    if (byte(0) < 0xC2 || byte(0) > 0xF4 || text.size() < length) return {};
    char32_t code = byte(0) & (0x7FU >> length);
    for (std::size_t n = 1; n < length; ++n) {
        if ((byte(n) & 0xC0U) != 0x80U) return {};
        code = code << 6U | (byte(n) & 0x3FU);
    }
    const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
    if (code < kMin[length] || code > 0x10FFFF || surrogate) return {};
    return {code, length};
}

bool steers(char32_t code) {
    const bool control = code < 0x20 || (code >= 0x7F && code < 0xA0);
    const bool line_end = code == 0x2028 || code == 0x2029;
    // The characters with Unicode's property Bidi_Control, which change the writing direction.
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
