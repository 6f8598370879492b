#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/text.h"

/// Code that is common to the readers of text files of points.
namespace covol::detail {

/// @throws Error InvalidInput with the message "path:line: what"; without a line, "path: what".
[[noreturn]] void fail(const std::string& path, std::size_t line, const std::string& what);
[[noreturn]] void fail(const std::string& path, const std::string& what);

/// A coordinate, which must be a finite number. @throws Error InvalidInput, which states path and line.
[[nodiscard]] double to_coordinate(const std::string& path, std::size_t line, std::string_view field);

/// Converts UTF-16 in either byte order, with or without a byte order mark, to UTF-8; other texts are unchanged.
[[nodiscard]] std::string to_utf8(std::string_view text);

/// Parses a number with a decimal point or a decimal comma. If points and commas occur, the last of them is the decimal
/// mark, and the others separate thousands. The result is empty if the field is not a number.
[[nodiscard]] std::optional<double> table_number(std::string_view field);

/// Delimiters of tables, in the order in which they are tried. A blank is tried last for names, which may contain
/// blanks, and a comma is tried last for numbers, which may contain decimal commas.
inline constexpr std::string_view kDelimitersOfNames = ";\t, ", kDelimitersOfNumbers = ";\t ,";

/// Whether the first three of the fields are numbers.
[[nodiscard]] bool begins_with_numbers(const std::vector<std::string_view>& fields);

/// Converts a unit of length in a column's name or a field: "(micron)" to "um". Empty if it is not a unit of length.
[[nodiscard]] std::string unit_of_length(std::string_view text);

}  // namespace covol::detail
