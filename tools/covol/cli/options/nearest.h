#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

// Suggestions for command lines that are invalid.
namespace covol::tool {

/// The known name with the fewest letters inserted, omitted, replaced or swapped; empty if none is close.
[[nodiscard]] std::string nearest(const std::string& word, const std::vector<std::string>& known);

/// A message with an unknown command or option, and the nearest known one; empty if all are known.
[[nodiscard]] std::string unknown_name(const CLI::App& program, const std::vector<std::string>& words);

/// "--delta 0.5 vx": the unit would be read as a file name. @throws UsageError.
void check_blanks(const std::vector<std::string>& words);

}  // namespace covol::tool
