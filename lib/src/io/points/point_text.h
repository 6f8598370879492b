#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// What the readers of text files of points share.
namespace covol::detail {

/// @throws Error InvalidInput, "read_points: path:line: what".
[[noreturn]] void fail(const std::string& path, std::size_t line, const std::string& what);
[[noreturn]] void fail(const std::string& path, const std::string& what);

[[nodiscard]] bool is_blank(char c);
[[nodiscard]] std::string_view trim(std::string_view text);
/// ASCII letters alone.
[[nodiscard]] std::string lower(std::string_view text);
/// What a message may quote of a file: short, and no control characters.
[[nodiscard]] std::string quote(std::string_view text);

[[nodiscard]] std::optional<double> to_number(std::string_view text);
/// A coordinate: a finite number. @throws Error with path:line.
[[nodiscard]] double to_coordinate(const std::string& path, std::size_t line, std::string_view field);

/// The lines of a text, counted from 1. Unix, DOS and old Macintosh line ends.
class Lines {
public:
    explicit Lines(std::string_view text);
    /// The next line, blanks at both ends removed; false at the end of the text.
    bool next(std::string_view& line);
    /// With its blanks: a leading tab is an empty first column.
    bool next_untrimmed(std::string_view& line);
    /// The next line that holds more than a comment, which '#' begins, and its words between blanks.
    bool next_words(std::string_view& line, std::vector<std::string_view>& words);
    [[nodiscard]] std::size_t number() const { return number_; }
    [[nodiscard]] std::string_view rest() const { return rest_; }

private:
    std::string_view rest_;
    char end_ = '\n';
    std::size_t number_ = 0;
};

/// Cuts a line at `delimiter`, outside double quotes; ' ' stands for any run of blanks.
void split(std::string_view line, char delimiter, std::vector<std::string_view>& fields);

}  // namespace covol::detail
