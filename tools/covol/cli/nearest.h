#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

// What a command line that cannot be understood was meant to say.
namespace covol::tool {

/// The word with the fewest letters inserted, left out, replaced or swapped; empty where none is close.
[[nodiscard]] std::string nearest(const std::string& word, const std::vector<std::string>& known);

/// Names a command or an option that there is not, and the nearest that there is; empty where all are known.
[[nodiscard]] std::string unknown_name(const CLI::App& program, const std::vector<std::string>& words);

/// "--delta 0.5 vx": the unit would be taken for a file. @throws UsageError.
void check_blanks(const std::vector<std::string>& words);

}  // namespace covol::tool
