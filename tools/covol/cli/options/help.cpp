#include "cli/options/help.h"

#include <array>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/options/first_steps.h"
#include "cli/options/job_options.h"

namespace covol::tool {
namespace {

constexpr std::size_t kColumn = 30;  // column in which descriptions begin
constexpr std::size_t kWidth = 100;  // maximum length of a line

// Headings of the groups of options, indexed by Group.
constexpr std::array kGroupNames{"Input", "Marks",  "How marks are read", "Point clouds", "Output",   "Mesh", "Picture",
                                 "Start", "Domain", "Image edges",        "Flow",         "Numerics", "Help"};

/// An entry of the help: `left`, then `text`, which begins in kColumn and is wrapped at kWidth. If `left` does not fit
/// before kColumn, `text` begins on the next line.
std::string entry(const std::string& left, const std::string& text) {
    std::string out = "  " + left;
    std::size_t used = out.size();
    if (used + 2 > kColumn) {
        out += '\n';
        used = 0;
    }
    out.append(kColumn - used, ' ');
    used = kColumn;
    std::istringstream words(text);
    for (std::string word; words >> word; used += word.size() + 1) {
        if (used > kColumn && used + word.size() > kWidth) {
            out.back() = '\n';
            out.append(kColumn, ' ');
            used = kColumn;
        }
        out += word + ' ';
    }
    out.back() = '\n';
    return out;
}

std::string entry(const CLI::Option& option) {
    const OptionHelp help = help_of(option);
    const bool together = help.names.empty() || help.value.empty() || help.value.starts_with("[=");
    std::string text = help.text;
    if (help.required) text += " (required)";
    if (!help.default_value.empty()) text += " [" + help.default_value + "]";
    return entry(help.names + (together ? "" : " ") + help.value, text);
}

using OptionList = std::vector<const CLI::Option*>;

OptionList options_in(const CLI::App& command, const std::string& group) {
    return command.get_options([&](const CLI::Option* option) { return option->get_group() == group; });
}

std::string section(const std::string& title, const OptionList& options) {
    if (options.empty()) return {};
    std::string text = "\n" + title + ":\n";
    for (const CLI::Option* option : options) text += entry(*option);
    return text;
}

/// The usage line, such as "Usage: covol segment IMAGE... -o OUT.vdb [OPTIONS]".
std::string usage(const CLI::App& command, const std::string& name) {
    std::string text = "Usage: " + name;
    for (const CLI::Option* option : command.get_options([](const CLI::Option* o) { return o->get_positional(); }))
        text += option->get_required() ? " " + option->get_type_name() : " [" + option->get_type_name() + "]";
    for (const CLI::Option* option :
         command.get_options([](const CLI::Option* o) { return !o->get_positional() && o->get_required(); }))
        text += (option->get_snames().empty() ? " --" + option->get_lnames().front()
                                              : " -" + option->get_snames().front()) +
                " " + option->get_type_name();
    return text + " [OPTIONS]\n";
}

const char* role_name(OptionRole role) {
    constexpr std::array kNames{"setting", "input", "output", "conduct"};
    return kNames[std::size_t(role)];
}

nlohmann::ordered_json to_json(const CLI::Option& option, bool first) {
    const OptionHelp help = help_of(option);
    return {{"names", help.names},
            {"value", help.value},
            {"text", help.text},
            {"default", help.default_value},
            {"required", help.required},
            {"first", first},
            {"role", role_name(role_of(option))}};
}

}  // namespace

void in_group(CLI::App& command, Group group) { command.option_defaults()->group(kGroupNames[std::size_t(group)]); }

OptionHelp help_of(const CLI::Option& option) {
    OptionHelp help;
    if (!option.get_positional()) {
        for (const std::string& name : option.get_snames()) help.names += (help.names.empty() ? "-" : ", -") + name;
        for (const std::string& name : option.get_lnames()) help.names += (help.names.empty() ? "--" : ", --") + name;
    }
    if (!option.get_option_text().empty())
        help.value = option.get_option_text();
    else if (option.get_type_size() != 0)
        help.value = option.get_type_name() == "FLOAT" ? "NUMBER"
                     : option.get_type_name() == "INT" ? "N"
                                                       : option.get_type_name();
    help.text = option.get_description();
    help.default_value = option.get_default_str();
    // The description of an option with an automatic choice ends with the text of this choice, in brackets.
    const std::size_t bracket = help.text.rfind(" [");
    if (help.default_value.empty() && help.text.ends_with(']') && bracket != std::string::npos) {
        help.default_value = help.text.substr(bracket + 2, help.text.size() - bracket - 3);
        help.text.erase(bracket);
    }
    for (const CLI::Option* other : option.get_excludes()) help.text += " (not with " + other->get_name() + ")";
    help.required = option.get_required();
    return help;
}

void Help::show_first(const CLI::App& command, const std::vector<std::string>& names) {
    for (const std::string& name : names) first_[&command].insert(command.get_option(name));
}

bool Help::is_shown(const CLI::App& command, const CLI::Option& option, bool all) const {
    const auto found = first_.find(&command);
    const bool about_help = &option == command.get_help_ptr() || &option == command.get_help_all_ptr();
    return all || found == first_.end() || about_help || option.get_required() || found->second.contains(&option);
}

std::string Help::make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const {
    const bool all = mode == CLI::AppFormatMode::All;
    return app->get_parent() == nullptr ? program_help(*app, name, all) : command_help(*app, name, all);
}

std::string Help::command_help(const CLI::App& command, const std::string& name, bool all) const {
    std::string text = command.get_description() + "\n\n" + usage(command, name);
    std::size_t shown = 0;
    for (const char* group : kGroupNames) {
        OptionList options = options_in(command, group);
        std::erase_if(options, [&](const CLI::Option* option) { return !is_shown(command, *option, all); });
        shown += options.size();
        text += section(group, options);
    }
    if (all) return text + section("Options of every command", options_in(*command.get_parent(), "Options"));
    text += '\n';
    if (const std::size_t rest = command.get_options().size() - shown; rest > 0)
        text += name + " --help-all shows " + std::to_string(rest) + " more options.\n";
    return text + command.get_footer() + "\n";
}

std::string Help::program_help(const CLI::App& program, const std::string& name, bool all) const {
    std::string text = program.get_description() + "\n\nUsage: " + name + " COMMAND [OPTIONS]\n\nTo begin with:\n" +
                       kFirstSteps + "\nCommands:\n";
    for (const CLI::App* command : program.get_subcommands({}))
        text += entry(command->get_name(), command->get_description());
    text += section("Options of every command", options_in(program, "Options"));
    text += section(kGroupNames[std::size_t(Group::Help)], options_in(program, kGroupNames[std::size_t(Group::Help)]));
    if (!all) return text + "\n" + program.get_footer() + "\n";
    for (const CLI::App* command : program.get_subcommands({}))
        text += "\n\n" + name + " " + command->get_name() + "\n" +
                command_help(*command, name + " " + command->get_name(), false);
    return text;
}

std::string Help::describe(const CLI::App& program) const {
    using Json = nlohmann::ordered_json;
    const auto groups_of = [&](const CLI::App& command) {
        Json groups = Json::array();
        const auto add = [&](const char* group) {
            Json list = Json::array();
            for (const CLI::Option* option : options_in(command, group))
                list.push_back(to_json(*option, is_shown(command, *option, false)));
            if (!list.empty()) groups.push_back({{"name", group}, {"options", list}});
        };
        add("Options");
        for (const char* group : kGroupNames) add(group);
        return groups;
    };
    Json commands = Json::array();
    for (const CLI::App* command : program.get_subcommands({}))
        commands.push_back({{"name", command->get_name()},
                            {"description", command->get_description()},
                            {"groups", groups_of(*command)}});
    return Json{{"common", groups_of(program)}, {"commands", commands}}.dump(2);
}

}  // namespace covol::tool
