#pragma once
#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

namespace covol::tool {

/// Files of options in TOML, for --config and --save-config. Some syntax of INI files is accepted, too: `;` comments,
/// values without quotes, lists without brackets, and flags without a value. Options are outside of sections or in the
/// section of their command; sections of other commands are skipped. Sections cannot be nested. At most 1 MiB. An
/// option may be given once; the values of a list may be on consecutive lines with the same name.
class ConfigFile : public CLI::Config {
public:
    explicit ConfigFile(const CLI::App& program) : program_(program) {}
    /// Reads the options of the command that is run, for which the command line has been parsed before.
    /// @throws UsageError with the file and the line that is invalid, or whose name or number of values is wrong.
    [[nodiscard]] std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;
    /// "--config FILE: line N: " if the last from_config() found this option and the command line did not give it; else
    /// empty.
    [[nodiscard]] std::string origin(const CLI::Option& option) const;
    /// Text with the options of `command` that were given. from_config() returns every value unchanged. If a shell
    /// interprets the file, it executes no part of a value as a command.
    [[nodiscard]] std::string to_config(const CLI::App* command, bool default_also, bool write_description,
                                        std::string prefix) const override;

private:
    const CLI::App& program_;
    mutable std::map<const CLI::Option*, std::string> origins_;
};

}  // namespace covol::tool
