#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace covol::tool {

/// Files of options in TOML, for --config and --save-config. Some syntax of INI files is accepted, too: `;` comments,
/// values without quotes, lists without brackets, and flags without a value. Options are outside of sections or in the
/// section of their command; sections of other commands are skipped. Sections cannot be nested. At most 1 MiB.
class ConfigFile : public CLI::Config {
public:
    explicit ConfigFile(const CLI::App& program) : program_(program) {}
    /// @throws UsageError with the line that is invalid.
    [[nodiscard]] std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;
    /// Text with the options of `command` that were given. from_config() returns every value unchanged. If a shell
    /// interprets the file, it executes no part of a value as a command.
    [[nodiscard]] std::string to_config(const CLI::App* command, bool default_also, bool write_description,
                                        std::string prefix) const override;

private:
    const CLI::App& program_;
};

}  // namespace covol::tool
