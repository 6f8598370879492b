#include "base/text.h"

#include <algorithm>

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
