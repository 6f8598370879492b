#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cli/output/json.h"

// A job as data: the command and options of a run as stored in a .vdb, a plan or a checkpoint, and their conversion
// back to a command line.
namespace covol::tool {

/// The effect of an option.
enum class OptionRole {
    Setting,  ///< changes the result, and names no file
    Input,    ///< names files to read
    Output,   ///< names a file to write
    Conduct   ///< controls how the run proceeds, and is not part of a job
};

/// Determined from the type name of the value, as shown in the help: the types of settings, inputs and outputs are
/// listed in job_options.cpp. An option of any other type is Conduct, and cannot be set by a file.
[[nodiscard]] OptionRole role_of(const CLI::Option& option);

/// A command, and the names and values of options that were given to it. job_of() stores the settings and inputs, in
/// the order in which the command defines its options.
struct JobOptions {
    std::string command;
    std::vector<std::pair<std::string, std::vector<std::string>>> values;
};

/// The settings and inputs of a parsed command line.
[[nodiscard]] JobOptions job_of(const CLI::App& command);

/// The option of a job by its name without dashes. @param source  the file that names it
/// @throws Error Unsupported if the command has no option of that name, or if its role is Conduct.
[[nodiscard]] const CLI::Option& option_of_job(const CLI::App& command, const std::string& name,
                                               const std::string& source);

/// The arguments of a command line that sets exactly the options of the job, even if values look like options: the
/// command, `more`, then --name=value for each option, then the positional arguments after "--".
/// @pre  `more` does not end with an option that takes any number of values
/// @throws Error InvalidInput for values that no command line can have given, Unsupported as for option_of_job().
[[nodiscard]] std::vector<std::string> command_line_of(const JobOptions& job, const CLI::App& command,
                                                       const std::string& source,
                                                       const std::vector<std::string>& more = {});

[[nodiscard]] Json to_json(const JobOptions& job);
/// @throws Error InvalidInput.
[[nodiscard]] JobOptions job_from_json(const Json& json, const std::string& source);

/// The text as one word of a shell command, in quotes if necessary, without control characters.
[[nodiscard]] std::string shell_quoted(const std::string& word);

}  // namespace covol::tool
