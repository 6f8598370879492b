#pragma once
#include <string>
#include <string_view>

#include "covol/api.h"

// Names and texts from files may contain characters that control a terminal or hide what is written.
namespace covol {

/// The text with each control character (C0, delete, C1), line separator and character that changes the writing
/// direction replaced by its number, `\u001b`, and each byte that is not UTF-8 by `\x9b`: safe on a terminal, in a page
/// and in a log. Texts without such characters are unchanged; within the strings of JSON the value remains the same.
[[nodiscard]] COVOL_API std::string safe_text(std::string_view text);

/// The same, but line breaks are kept.
[[nodiscard]] COVOL_API std::string safe_lines(std::string_view text);

}  // namespace covol
