#pragma once
#include <CLI/CLI.hpp>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "covol/options_table.h"

// Help of the commands: options in groups, either the most common ones or all.
namespace covol::tool {

/// Options that are added to `command` from here on belong to this group.
void in_group(CLI::App& command, Group group);

/// Groups are for the help only: CLI11 would sort the options of a configuration file by them.
void forget_groups(CLI::App& command);

/// An option as shown in the help.
struct OptionHelp {
    std::string names;          ///< "-o, --output"; empty for a positional
    std::string value;          ///< "OUT.vdb"; empty for a flag
    std::string text;           ///< without the default
    std::string default_value;  ///< value if the option is not given, a number or text; empty: none
    bool required = false;
};
[[nodiscard]] OptionHelp help_of(const CLI::Option& option);

class Help : public CLI::FormatterBase {
public:
    /// Selects the options that `--help` of this command shows besides the required ones; `--help-all` shows all.
    /// Without this call both show all.
    /// @param names  "--points", or the name of a positional
    void show_first(const CLI::App& command, const std::vector<std::string>& names);

    [[nodiscard]] std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override;

    /// Every option of every command, in groups, as JSON: the source of the tables in docs/commands.
    [[nodiscard]] std::string describe(const CLI::App& program) const;

private:
    [[nodiscard]] bool is_shown(const CLI::App& command, const CLI::Option& option, bool all) const;
    [[nodiscard]] std::string command_help(const CLI::App& command, const std::string& name, bool all) const;
    [[nodiscard]] std::string program_help(const CLI::App& program, const std::string& name, bool all) const;

    std::map<const CLI::App*, std::set<const CLI::Option*>> first_;
};

}  // namespace covol::tool
