#include "cli/options/parsed_options.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "cli/options/arguments.h"
#include "cli/output/provenance.h"

namespace covol::tool {
namespace {

Json to_value(const std::string& text) {
    if (text == "true") return true;
    if (text == "false") return false;
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (!text.empty() && *end == '\0' && std::isfinite(value)) {
        if (value == std::floor(value) && std::abs(value) < 1e15) return static_cast<std::int64_t>(value);
        return value;
    }
    return text;
}

}  // namespace

std::vector<std::string> names_of(const CLI::App& command, OptionRole role) {
    std::vector<std::string> names;
    for (const CLI::Option* option : command.get_options())
        if (role_of(*option) == role) names.push_back(option->get_single_name());
    return names;
}

std::vector<std::string> given_names(const CLI::App& command) {
    std::vector<std::string> names;
    for (const CLI::Option* option : command.get_options())
        if (option->count() > 0) names.push_back(option->get_single_name());
    return names;
}

Json values_of_options(const CLI::App& command) {
    Json options = Json::object();
    for (const CLI::Option* option : command.get_options()) {
        std::string name = option->get_single_name();
        if (name == "help" || name.empty()) continue;
        if (option->count() == 0) {
            if (!option->get_default_str().empty()) options[name] = to_value(option->get_default_str());
            continue;
        }
        const std::vector<std::string>& given = option->results();
        if (option->get_expected_max() > 1) {
            Json list = Json::array();
            for (const std::string& text : given) list.push_back(text);
            options[name] = list;
        } else {
            options[name] = to_value(given.back());
        }
    }
    return options;
}

std::vector<std::string> inputs_of(const CLI::App& command) {
    std::vector<std::string> inputs;
    for (const CLI::Option* option : command.get_options()) {
        if (const OptionRole role = role_of(*option); role == OptionRole::Output || role == OptionRole::Conduct)
            continue;
        for (const std::string& text : option->results()) {
            const std::vector<std::string> frames = files_of_frames(text);
            inputs.insert(inputs.end(), frames.begin(), frames.end());
            for (const std::size_t begin : {std::size_t(0), text.find('=') + 1, text.find(':') + 1})
                for (const std::size_t end : {text.size(), text.rfind(':'), text.find(":/")}) {
                    if (end == std::string::npos || end <= begin) continue;
                    std::error_code status;
                    const std::string path = text.substr(begin, end - begin);
                    if ((std::filesystem::is_regular_file(path, status) ||
                         std::filesystem::is_directory(path, status)) &&
                        std::find(inputs.begin(), inputs.end(), path) == inputs.end())
                        inputs.push_back(path);
                }
        }
    }
    return inputs;
}

void expect_values(const CLI::App& app) {
    for (const CLI::Option* option : app.get_options()) {
        const std::vector<std::string>& given = option->results();
        if (option->get_expected_min() > 0 && std::find(given.begin(), given.end(), "") != given.end())
            throw UsageError(option->get_name() + ": expected a value, got ''");
    }
}

}  // namespace covol::tool
