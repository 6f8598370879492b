#pragma once
// Functions that are common to the readers of text files.
#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace covol::detail {

[[nodiscard]] inline bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }
[[nodiscard]] std::string_view trim(std::string_view text);
/// Converts ASCII letters only.
[[nodiscard]] std::string lower(std::string_view text);
/// A quoted part of a file for messages: at most 40 characters, with control characters replaced by question marks.
[[nodiscard]] std::string quote(std::string_view text);

template <typename T = double>
[[nodiscard]] std::optional<T> to_number(std::string_view text) {
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    T value{};
    const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (status != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

/// The lines of a text, counted from 1. Accepts line ends of Unix, DOS and old Macintosh systems.
class Lines {
public:
    explicit Lines(std::string_view text);
    /// The next line, with blanks removed at both ends; false at the end of the text.
    bool next(std::string_view& line);
    /// The next line with its blanks, because a leading tab means an empty first column; false at the end of the text.
    bool next_untrimmed(std::string_view& line);
    /// The next line with content other than a comment, which begins with '#' and is removed.
    bool next_content(std::string_view& line);
    /// The line that next_content() returns, split into words at blanks.
    bool next_words(std::string_view& line, std::vector<std::string_view>& words);
    [[nodiscard]] std::size_t number() const { return number_; }
    [[nodiscard]] std::string_view rest() const { return rest_; }
    /// @pre count <= rest().size()
    void skip(std::size_t count) { rest_.remove_prefix(count); }

private:
    std::string_view rest_;
    char end_ = '\n';
    std::size_t number_ = 0;
};

/// Removes the first word from a line and returns it; empty if the line contains only blanks.
[[nodiscard]] inline std::string_view next_word(std::string_view& line) {
    std::size_t begin = 0;
    while (begin < line.size() && is_blank(line[begin])) ++begin;
    std::size_t end = begin;
    while (end < line.size() && !is_blank(line[end])) ++end;
    const std::string_view word = line.substr(begin, end - begin);
    line.remove_prefix(end);
    return word;
}

/// Splits a line at `delimiter`, except within double quotes; ' ' means any run of blanks.
void split(std::string_view line, char delimiter, std::vector<std::string_view>& fields);

}  // namespace covol::detail
