#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace covol::tool {

/// Files of options, for --config and --save-config: TOML. Of INI, `#` and `;` comments, values without quotes, lists
/// without brackets and flags without a value are accepted, too. Options are outside of sections or in the section of
/// their command; sections of other commands are skipped, and sections are not nested. At most 1 MiB.
class ConfigFile : public CLI::Config {
public:
    explicit ConfigFile(const CLI::App& program) : program_(program) {}
    /// @throws UsageError with the line that is invalid.
    [[nodiscard]] std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;
    /// The options of a command that were given. Every value reads back unchanged, and no shell that interprets the
    /// file executes a part of a value as a command.
    [[nodiscard]] std::string to_config(const CLI::App* command, bool default_also, bool write_description,
                                        std::string prefix) const override;

private:
    const CLI::App& program_;
};

}  // namespace covol::tool
