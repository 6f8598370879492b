#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

// Suggestions for command lines that are invalid.
namespace covol::tool {

/// The known name that differs from the word by the fewest inserted, omitted, replaced or swapped letters, or else one
/// that begins with the word; empty if none is close.
[[nodiscard]] std::string nearest(const std::string& word, const std::vector<std::string>& known);

/// "; did you mean X?" for a known name X; empty for an empty one.
[[nodiscard]] std::string did_you_mean(const std::string& close);

/// An error message that names the first unknown command or option and the nearest known one; empty if all are known.
[[nodiscard]] std::string unknown_name(const CLI::App& program, const std::vector<std::string>& words);

/// Refuses lengths with a blank before the unit, such as "--delta 0.5 vx": "vx" would be read as a file name.
/// @throws UsageError.
void check_blanks(const std::vector<std::string>& words);

}  // namespace covol::tool
