#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cli/json.h"

// A job as data: what a .vdb, a plan or a checkpoint says of a run, and how it becomes a command line again.
namespace covol::tool {

/// What an option does.
enum class OptionRole {
    Setting,  ///< changes the result, and names no file
    Input,    ///< names files to read
    Output,   ///< names a file to write
    Conduct   ///< says how the run goes on: no part of a job
};

/// By the name of the value's type, which help shows: those of settings, inputs and outputs are listed in the source,
/// and an option of any other type is conduct, which no file can ask for.
[[nodiscard]] OptionRole role_of(const CLI::Option& option);

/// A command and the options that were given to it, each with its values, in the order of the command's table.
struct JobOptions {
    std::string command;
    std::vector<std::pair<std::string, std::vector<std::string>>> values;
};

/// The settings and inputs of a command line that was parsed.
[[nodiscard]] JobOptions job_of(const CLI::App& command);

/// The option of a job by its name without dashes. @param source  the file that names it
/// @throws Error Unsupported where the command has none of that name, or it is conduct.
[[nodiscard]] const CLI::Option& option_of_job(const CLI::App& command, const std::string& name,
                                               const std::string& source);

/// The words of a command line that gives exactly these values to exactly these options, whatever the values are:
/// `more` after the command, then --name=value, then what has no name behind "--".
/// @pre  `more` does not end with an option that takes any number of values
/// @throws Error InvalidInput for values that no command line can have given, Unsupported as option_of_job().
[[nodiscard]] std::vector<std::string> words_of(const JobOptions& job, const CLI::App& command,
                                                const std::string& source, const std::vector<std::string>& more = {});

[[nodiscard]] Json to_json(const JobOptions& job);
/// @throws Error InvalidInput.
[[nodiscard]] JobOptions job_from_json(const Json& json, const std::string& source);

/// A word as a shell reads it back, without a control character in it.
[[nodiscard]] std::string shell_quoted(const std::string& word);

}  // namespace covol::tool
