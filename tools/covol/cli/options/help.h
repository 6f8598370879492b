#pragma once
#include <CLI/CLI.hpp>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "covol/options_table.h"

// Help of the commands: options in groups, either the most common ones or all.
namespace covol::tool {

/// Options that are added to `command` after this call belong to this group.
void in_group(CLI::App& command, Group group);

/// An option as shown in the help.
struct OptionHelp {
    std::string names;          ///< "-o, --output"; empty for a positional argument
    std::string value;          ///< "OUT.vdb"; empty for a flag
    std::string text;           ///< description without the default value
    std::string default_value;  ///< value or text of the automatic choice if the option is not given; empty: none
    bool required = false;
};
[[nodiscard]] OptionHelp help_of(const CLI::Option& option);

class Help : public CLI::FormatterBase {
public:
    /// Selects the options that `--help` of this command shows besides the required ones; `--help-all` shows all.
    /// Without this call, both show all options.
    /// @param names  names of options ("--points") or of positional arguments
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
