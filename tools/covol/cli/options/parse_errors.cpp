#include "cli/options/parse_errors.h"

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <vector>

#include "cli/options/config_file.h"
#include "cli/options/help.h"
#include "cli/options/nearest.h"
#include "covol/safe_text.h"

namespace covol::tool {
namespace {

const CLI::App* command_of(const CLI::App& program) {
    const std::vector<CLI::App*> parsed = program.get_subcommands();
    return parsed.empty() ? nullptr : parsed.front();
}

/// The option of the command or of the program with this name; null if there is none.
const CLI::Option* option_called(const CLI::App& program, const std::string& name) {
    if (name.empty()) return nullptr;
    const CLI::App* const command = command_of(program);
    const CLI::Option* const own = command == nullptr ? nullptr : command->get_option_no_throw(name);
    return own != nullptr ? own : program.get_option_no_throw(name);
}

/// The part of `text` before the first `mark`; empty if there is none.
std::string before(const std::string& text, std::string_view mark) {
    const std::size_t at = text.find(mark);
    return at == std::string::npos ? "" : text.substr(0, at);
}

std::string after(const std::string& text, std::string_view mark) {
    const std::size_t at = text.find(mark);
    return at == std::string::npos ? "" : text.substr(at + mark.size());
}

std::string list_of(const std::vector<std::string>& values) {
    constexpr std::size_t kListed = 4;
    std::string list;
    for (std::size_t n = 0; n < std::min(values.size(), kListed); ++n)
        list += (n > 0 ? ", " : "") + in_quotes(values[n]);
    return list + (values.size() > kListed ? ", ..." : "");
}

/// The words of a type name that lists the allowed ones, such as "guided|paper"; empty if it does not.
std::vector<std::string> words_of(const std::string& type) {
    const bool is_list = type.find('|') != std::string::npos && std::all_of(type.begin(), type.end(), [](char c) {
                             return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '|';
                         });
    std::vector<std::string> words;
    for (std::size_t begin = 0; is_list && begin <= type.size();) {
        const std::size_t end = std::min(type.find('|', begin), type.size());
        words.push_back(type.substr(begin, end - begin));
        begin = end + 1;
    }
    return words;
}

bool is_whole(const std::string& text) {
    const std::size_t begin = text.starts_with('-') || text.starts_with('+') ? 1 : 0;
    return text.size() > begin &&
           std::all_of(text.begin() + std::ptrdiff_t(begin), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// What an option expects, and what it got instead.
std::string wrong_value(const CLI::Option& option) {
    const std::string value = option.results().empty() ? "" : option.results().back();
    const std::string type = help_of(option).value, got = ", got " + in_quotes(value);
    if (option.get_expected_max() == 0) return "expected true or false" + got;
    if (type == "N")
        return std::string("expected a whole number") + (is_whole(value) ? " in the range of this option" : "") + got;
    const std::vector<std::string> words = words_of(type);
    if (words.empty()) return "expected a number" + (type == "NUMBER" ? "" : " (" + type + ")") + got;
    std::string list;
    for (std::size_t n = 0; n < words.size(); ++n)
        list += (n == 0 ? "" : n + 1 < words.size() ? ", " : " or ") + words[n];
    const std::string close = nearest(value, words);
    return "expected " + list + got + did_you_mean(close);
}

std::string no_value(const CLI::Option& option) {
    const std::string type = help_of(option).value;
    return "expected a value" + (type.empty() ? "" : ", " + type) + ", got none";
}

std::string several_values(const CLI::Option& option, bool is_config) {
    const std::string got =
        ", got " + std::to_string(option.results().size()) + " (" + list_of(option.results()) + "); ";
    return is_config ? "expected one file of options" + got + "write all options into one file"
                     : "expected one value" + got + "give the option once";
}

std::string missing(const CLI::Option& option) {
    const OptionHelp help = help_of(option);
    return "expected " + help.names + (help.names.empty() || help.value.empty() ? "" : " ") + help.value +
           ", which is required";
}

std::string unexpected(const std::vector<std::string>& words, const CLI::App& command) {
    std::string taken;
    for (const CLI::Option* option : command.get_options([](const CLI::Option* o) { return o->get_positional(); }))
        taken += option->get_type_name() + " and ";
    return "unexpected: " + list_of(words) + "; covol " + command.get_name() + " takes only " + taken + "options";
}

std::string unreadable_file(const std::string& path) {
    std::error_code status;
    const char* what = "no such file";
    if (std::filesystem::is_directory(path, status))
        what = "expected a file of options, got a folder";
    else if (std::filesystem::exists(path, status))
        what = "the file cannot be read";
    return "--config " + path + ": " + what;
}

/// The message without the place of the help; that of CLI11 if it is of a kind that covol does not cause.
std::string text_of(const CLI::ParseError& error, const CLI::App& program) {
    const std::string text = error.what(), kind = error.get_name();
    const CLI::App* const command = command_of(program);
    if (kind == "FileError")
        if (const std::string path = before(text, " was not readable"); !path.empty()) return unreadable_file(path);
    // The name of this kind of error is that of the program.
    if (text.find(" not expected: ") != std::string::npos && command != nullptr)
        return unexpected(program.remaining(true), *command);
    if (kind == "RequiredError" && command == nullptr) return "expected a command, such as covol segment";
    const std::string name = kind == "ConversionError" ? before(after(text, "Could not convert: "), " = ")
                             : kind == "RequiredError" ? before(text, " is required")
                                                       : before(text, ": ");
    const CLI::Option* const option = option_called(program, name);
    if (option == nullptr) return text;
    const std::string origin = origin_of(program, name);
    if (kind == "RequiredError") return missing(*option);
    if (kind == "ConversionError") return origin + name + ": " + wrong_value(*option);
    if (kind == "ArgumentMismatch")
        return origin + name + ": " +
               (text.find("At Most") == std::string::npos
                    ? no_value(*option)
                    : several_values(*option, option == program.get_config_ptr()));
    if (kind == "ValidationError")
        return origin + name + ": " +
               (words_of(help_of(*option).value).empty() ? after(text, ": ") : wrong_value(*option));
    return text;
}

}  // namespace

std::string explain(const CLI::ParseError& error, const CLI::App& program) {
    const CLI::App* const command = command_of(program);
    const std::string text = text_of(error, program);
    return text + (text.ends_with('?') ? " See" : "; see") + " covol " +
           (command == nullptr ? "" : command->get_name() + " ") + "--help";
}

std::string origin_of(const CLI::App& program, const std::string& name) {
    const CLI::Option* const option = option_called(program, name);
    const auto file = std::dynamic_pointer_cast<const ConfigFile>(program.get_config_formatter());
    return option == nullptr || file == nullptr ? "" : file->origin(*option);
}

std::string in_quotes(const std::string& text) {
    constexpr std::size_t kShown = 60;
    return "'" + safe_text(text.substr(0, kShown)) + (text.size() > kShown ? "..." : "") + "'";
}

}  // namespace covol::tool
