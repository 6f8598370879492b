#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cli/output/json.h"

// A job as data: what a .vdb, a plan or a checkpoint stores of a run, and its conversion back to a command line.
namespace covol::tool {

/// The effect of an option.
enum class OptionRole {
    Setting,  ///< changes the result, and names no file
    Input,    ///< names files to read
    Output,   ///< names a file to write
    Conduct   ///< controls how the run proceeds: not part of a job
};

/// Determined from the type name of the value, as shown in the help: the types of settings, inputs and outputs are
/// listed in the source. An option of any other type is conduct, which no file can set.
[[nodiscard]] OptionRole role_of(const CLI::Option& option);

/// A command and the options that were given to it with their values, in the order of the command's table.
struct JobOptions {
    std::string command;
    std::vector<std::pair<std::string, std::vector<std::string>>> values;
};

/// The settings and inputs of a parsed command line.
[[nodiscard]] JobOptions job_of(const CLI::App& command);

/// The option of a job by its name without dashes. @param source  the file that names it
/// @throws Error Unsupported if the command has no option of that name, or if it is conduct.
[[nodiscard]] const CLI::Option& option_of_job(const CLI::App& command, const std::string& name,
                                               const std::string& source);

/// The arguments of a command line that gives exactly these values to exactly these options, whatever the values are:
/// `more` after the command, then --name=value, then positionals after "--".
/// @pre  `more` does not end with an option that takes any number of values
/// @throws Error InvalidInput for values that no command line can have given, Unsupported as option_of_job().
[[nodiscard]] std::vector<std::string> command_line_of(const JobOptions& job, const CLI::App& command,
                                                       const std::string& source,
                                                       const std::vector<std::string>& more = {});

[[nodiscard]] Json to_json(const JobOptions& job);
/// @throws Error InvalidInput.
[[nodiscard]] JobOptions job_from_json(const Json& json, const std::string& source);

/// The text quoted for a shell, without control characters.
[[nodiscard]] std::string shell_quoted(const std::string& word);

}  // namespace covol::tool
