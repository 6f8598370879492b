#pragma once
#include <string>
#include <string_view>

#include "covol/api.h"

// Names and texts from files may contain characters that control a terminal or hide parts of the text.
namespace covol {

/// The text with each control character (C0, delete, C1), line separator and character that changes the writing
/// direction replaced by its code, such as `\u001b`, and each byte that is not UTF-8 by its value, such as `\x9b`. The
/// result is safe on a terminal, in a page and in a log. Texts without such characters are unchanged; if the text is
/// JSON, the values of its strings remain the same.
[[nodiscard]] COVOL_API std::string safe_text(std::string_view text);

/// The text with the replacements of safe_text(), but with its line breaks kept.
[[nodiscard]] COVOL_API std::string safe_lines(std::string_view text);

}  // namespace covol
