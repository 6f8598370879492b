#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "cli/options/job_options.h"
#include "cli/output/json.h"

// What a parsed command line contains.
namespace covol::tool {

/// Names of the options that have this role, without dashes.
[[nodiscard]] std::vector<std::string> names_of(const CLI::App& command, OptionRole role);
/// Names of the options that the command line or a configuration file gave, without dashes.
[[nodiscard]] std::vector<std::string> given_names(const CLI::App& command);
/// The options as the user gave them, or their defaults; names as on the command line.
[[nodiscard]] Json values_of_options(const CLI::App& command);
/// Files and folders that the command line names as inputs: every existing path in the value of an option that is not
/// an output, which may be preceded by the name of a structure or the kind of a start (NAME=FILE, mesh:FILE), and
/// followed by the name of a grid or the path of a dataset.
[[nodiscard]] std::vector<std::string> inputs_of(const CLI::App& command);
/// An empty value, such as a shell's unset variable, is never intended. @throws UsageError
void expect_values(const CLI::App& app);

}  // namespace covol::tool
