#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace covol::tool {

/// Files of options, for --config and --save-config: TOML, of which INI's `#` and `;` comments, values without quotes,
/// lists without brackets and flags without a value are understood, too. Options stand in no section, or in that of
/// their command; sections of other commands are skipped, and nothing nests. At most 1 MiB.
class ConfigFile : public CLI::Config {
public:
    explicit ConfigFile(const CLI::App& program) : program_(program) {}
    /// @throws UsageError with the line that is not understood.
    [[nodiscard]] std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;
    /// The options of a command that were given. Every value reads back as it was, and no shell that is given the file
    /// takes a part of a value for a command.
    [[nodiscard]] std::string to_config(const CLI::App* command, bool default_also, bool write_description,
                                        std::string prefix) const override;

private:
    const CLI::App& program_;
};

}  // namespace covol::tool
