#include "cli/options/job_options.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <set>
#include <string_view>

#include "covol/error.h"
#include "covol/safe_text.h"

namespace covol::tool {
namespace {

// Type names of option values, by the role of the options: see role_of(). The class Roles of tests/cli/trust_test.py
// checks which options are outputs, which are Conduct, and examples of inputs and settings.
constexpr std::array<std::string_view, 19> kSettings{"N",
                                                     "INT",
                                                     "UINT",
                                                     "FLOAT",
                                                     "NUMBER",
                                                     "LENGTH",
                                                     "VOXELS",
                                                     "LABEL",
                                                     "FACTOR",
                                                     "X,Y,Z",
                                                     "SX,SY,SZ",
                                                     "KIND",
                                                     "NAME",
                                                     "X0,Y0,Z0,X1,Y1,Z1",
                                                     "all|N|A-B",
                                                     "WIDTHxHEIGHT",
                                                     "NAME|AZ,EL",
                                                     "[NAME:]X,Y,Z",
                                                     "[NAME=]FRACTION..."};
constexpr std::array<std::string_view, 21> kInputs{
    "IMAGE",        "IMAGE...", "FILE",     "FILE...",     "[NAME=]FILE", "[NAME=]FILE...", "[NAME=]FILE|X,Y,Z",
    "FILE|X,Y,Z",   "START",    "IN",       "A",           "B",           "IN.vdb[:NAME]",  "U.vdb",
    "DISTANCE.vdb", "BAND.vdb", "EDGE.vdb", "REPORT.json", "FILE.vdb",    "FOLDER...",      "STUDY"};

template <typename List>
bool contains(const List& list, std::string_view type) {
    return std::find(list.begin(), list.end(), type) != list.end();
}

/// Whether the type name lists the allowed words, such as "guided|paper".
bool is_choice(std::string_view type) {
    return !type.empty() && std::all_of(type.begin(), type.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '|';
    });
}

bool is_flag(const CLI::Option& option) { return option.get_expected_max() == 0; }

[[noreturn]] void refuse(const std::string& source, const std::string& name, const std::string& why) {
    throw Error(Errc::InvalidInput, source + ": '" + name + "': " + why);
}

void check_value(const CLI::Option& option, const std::string& name, const std::string& value,
                 const std::string& source) {
    if (value.empty()) refuse(source, name, "expected a value, got none");
    if (value.find('\0') != std::string::npos) refuse(source, name, "expected a value without null characters");
    // CLI11 would split a text in brackets into several values.
    if (option.get_allow_extra_args() && value.front() == '[' && value.back() == ']')
        refuse(source, name, "expected one value, got the list " + value);
}

}  // namespace

OptionRole role_of(const CLI::Option& option) {
    const std::string type = option.get_type_name();
    if (!option.get_configurable() || type == "OUT_FOLDER") return OptionRole::Conduct;
    if (type.starts_with("OUT")) return OptionRole::Output;
    if (contains(kInputs, type)) return OptionRole::Input;
    return is_flag(option) || contains(kSettings, type) || is_choice(type) ? OptionRole::Setting : OptionRole::Conduct;
}

JobOptions job_of(const CLI::App& command) {
    JobOptions job{command.get_name(), {}};
    for (const CLI::Option* option : command.get_options()) {
        const OptionRole role = role_of(*option);
        if (option->count() > 0 && (role == OptionRole::Setting || role == OptionRole::Input))
            job.values.emplace_back(option->get_single_name(), option->reduced_results());
    }
    return job;
}

const CLI::Option& option_of_job(const CLI::App& command, const std::string& name, const std::string& source) {
    const CLI::Option* option = command.get_option_no_throw("--" + name);
    if (option == nullptr) option = command.get_option_no_throw(name);
    if (option == nullptr || option->get_single_name() != name)
        throw Error(Errc::Unsupported,
                    source + ": this covol has no option '" + name + "' of '" + command.get_name() + "'");
    if (role_of(*option) == OptionRole::Conduct)
        throw Error(Errc::Unsupported,
                    source + ": it contains --" + name +
                        ", which controls how a run proceeds and is allowed on the command line only");
    return *option;
}

std::vector<std::string> command_line_of(const JobOptions& job, const CLI::App& command, const std::string& source,
                                         const std::vector<std::string>& more) {
    std::vector<std::string> words{job.command}, positional;
    words.insert(words.end(), more.begin(), more.end());
    std::set<std::string> seen;
    const CLI::Option* last = nullptr;
    for (const auto& [name, values] : job.values) {
        const CLI::Option& option = option_of_job(command, name, source);
        if (!seen.insert(name).second) refuse(source, name, "it is given twice");
        if (values.empty() || (values.size() > 1 && option.get_expected_max() <= 1))
            refuse(source, name, "expected one value, got " + std::to_string(values.size()));
        for (const std::string& value : values) {
            check_value(option, name, value, source);
            if (option.get_positional()) {
                positional.push_back(value);
            } else {
                words.push_back("--" + name + (is_flag(option) && value == "true" ? "" : "=" + value));
                last = &option;
            }
        }
    }
    if (positional.empty()) return words;
    // After an option that takes any number of values, CLI11 uses the first "--" only to end these values. Positional
    // arguments then begin after a second one.
    words.insert(words.end(), last != nullptr && last->get_allow_extra_args() ? 2 : 1, "--");
    words.insert(words.end(), positional.begin(), positional.end());
    return words;
}

Json to_json(const JobOptions& job) {
    Json options = Json::object();
    for (const auto& [name, values] : job.values) options[name] = values;
    return {{"command", job.command}, {"options", options}};
}

JobOptions job_from_json(const Json& json, const std::string& source) {
    try {
        JobOptions job{json.at("command").get<std::string>(), {}};
        const Json& options = json.at("options");
        if (!options.is_object()) throw Error(Errc::InvalidInput, source + ": expected the options of a job");
        for (const auto& [name, values] : options.items())
            job.values.emplace_back(name, values.get<std::vector<std::string>>());
        return job;
    } catch (const Json::exception& error) {
        throw Error(Errc::InvalidInput, source + ": expected a job with its command and its options: " + error.what());
    }
}

std::string shell_quoted(const std::string& word) {
    constexpr const char* kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_./:=,+@%-";
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
    if (safe_text(word) == word) {
        std::string quoted = "'";
        for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
        return quoted + "'";
    }
    std::string quoted = "$'";
    for (const char c : word) {
        const auto byte = static_cast<unsigned char>(c);
        char number[8];
        std::snprintf(number, sizeof number, "\\%03o", unsigned(byte));
        if (byte < 0x20 || byte >= 0x7F)
            quoted += number;
        else
            quoted += c == '\'' || c == '\\' ? std::string("\\") + c : std::string(1, c);
    }
    return quoted + "'";
}

}  // namespace covol::tool
