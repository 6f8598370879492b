#pragma once
#include <string>
#include <string_view>

#include "covol/api.h"

// Names and texts that come from files may hold what steers a terminal, or hides what is written.
namespace covol {

/// The text with each control character (C0, delete, C1), line separator and sign that changes the direction of writing
/// as its number, `\u001b`, and each byte that is no UTF-8 as `\x9b`: safe on a terminal, in a page and in a log. Texts
/// without such characters are as they were; within the strings of JSON it leaves the value the same.
[[nodiscard]] COVOL_API std::string safe_text(std::string_view text);

/// The same, with its line ends.
[[nodiscard]] COVOL_API std::string safe_lines(std::string_view text);

}  // namespace covol
