#pragma once
#include <CLI/CLI.hpp>
#include <string>

// Messages about command lines and files of options that CLI11 refuses.
namespace covol::tool {

/// The message of a parse error: which option, from which file and line if a file gave it, what was expected, and where
/// the help is.
[[nodiscard]] std::string explain(const CLI::ParseError& error, const CLI::App& program);

/// "--config FILE: line N: " if the file of options gave this option of the command that is run; else empty.
/// @param name  as on the command line, or of a positional
[[nodiscard]] std::string origin_of(const CLI::App& program, const std::string& name);

/// The text in single quotes, without what follows the first 60 bytes.
[[nodiscard]] std::string in_quotes(const std::string& text);

}  // namespace covol::tool
