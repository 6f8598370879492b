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
/// The values of the options by name: as given by the user, otherwise the default. Options without a value are left
/// out.
[[nodiscard]] Json values_of_options(const CLI::App& command);
/// Files and folders that the command line names as inputs: every existing path in the values of settings and inputs.
/// A path may be preceded by the name of a structure or the kind of a start (NAME=FILE, mesh:FILE), and followed by the
/// name of a grid or the path of a dataset. The files of all frames are included for a name with {frame}.
[[nodiscard]] std::vector<std::string> inputs_of(const CLI::App& command);
/// Refuses empty values, which result from unset variables of a shell. @throws UsageError
void expect_values(const CLI::App& app);

}  // namespace covol::tool
