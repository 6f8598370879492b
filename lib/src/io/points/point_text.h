#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/text.h"

/// What the readers of text files of points share.
namespace covol::detail {

/// @throws Error InvalidInput, "path:line: what".
[[noreturn]] void fail(const std::string& path, std::size_t line, const std::string& what);
[[noreturn]] void fail(const std::string& path, const std::string& what);

/// A coordinate: a finite number. @throws Error with path:line.
[[nodiscard]] double to_coordinate(const std::string& path, std::size_t line, std::string_view field);

/// UTF-16 of either byte order, with its mark or without, as UTF-8; other texts as they are.
[[nodiscard]] std::string to_utf8(std::string_view text);

/// A number with a decimal point or a decimal comma. Of both marks the last one is the decimal one, and the others part
/// thousands.
[[nodiscard]] std::optional<double> table_number(std::string_view field);

/// What parts the fields of tables, in the order in which they are tried: names have blanks, numbers commas.
inline constexpr std::string_view kDelimitersOfNames = ";\t, ", kDelimitersOfNumbers = ";\t ,";

/// Whether the first three of the fields are numbers.
[[nodiscard]] bool begins_with_numbers(const std::vector<std::string_view>& fields);

/// The unit of length that a column's name or a field means: "um" of "(micron)"; empty where it means none.
[[nodiscard]] std::string unit_of_length(std::string_view text);

}  // namespace covol::detail
