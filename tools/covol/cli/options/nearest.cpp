#include "cli/options/nearest.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <numeric>

#include "cli/options/arguments.h"

namespace covol::tool {
namespace {

/// Optimal string alignment distance: the number of letters to insert, delete, replace or swap.
std::size_t distance(const std::string& a, const std::string& b) {
    std::vector<std::size_t> before, last(b.size() + 1), row(b.size() + 1);
    std::iota(last.begin(), last.end(), std::size_t(0));
    for (std::size_t i = 1; i <= a.size(); ++i) {
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = std::min(row[j], before[j - 2] + 1);
        }
        before = last;
        last = row;
    }
    return last[b.size()];
}

bool is_number(const std::string& word) {
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size();
}

/// The long and short names of all options, with their dashes.
std::vector<std::string> names_of_options(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options()) {
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
        for (const std::string& name : option->get_snames()) names.push_back("-" + name);
    }
    return names;
}

std::string with_hint(const std::string& message, const std::string& close, const std::string& help) {
    return message + (close.empty() ? "." : did_you_mean(close)) + " See " + help;
}

}  // namespace

std::string did_you_mean(const std::string& close) { return close.empty() ? "" : "; did you mean " + close + "?"; }

std::string nearest(const std::string& word, const std::vector<std::string>& known) {
    const std::size_t bound = std::max<std::size_t>(1, std::min<std::size_t>(3, word.size() / 3));
    std::string best;
    std::size_t minimum = bound + 1;
    for (const std::string& name : known) {
        const std::size_t d = distance(word, name);
        if (d < minimum) {
            minimum = d;
            best = name;
        }
    }
    if (!best.empty()) return best;
    // If no known name is close, the first one that begins with the word is returned, for words of at least 4 letters.
    for (const std::string& name : known)
        if (name.size() > word.size() && word.size() > 3 && name.starts_with(word)) return name;
    return {};
}

std::string unknown_name(const CLI::App& program, const std::vector<std::string>& words) {
    std::vector<std::string> commands;
    for (const CLI::App* command : program.get_subcommands({})) commands.push_back(command->get_name());
    const auto is_command = [&](const std::string& word) {
        return std::find(commands.begin(), commands.end(), word) != commands.end();
    };
    const auto chosen = std::find_if(words.begin(), words.end(), is_command);
    if (chosen == words.end() && !words.empty() && !words[0].starts_with('-'))
        return with_hint("'" + words[0] + "' is not a command of covol", nearest(words[0], commands), "covol --help");
    std::vector<std::string> names = names_of_options(program);
    std::string help = "covol --help";
    if (chosen != words.end()) {
        const std::vector<std::string> own = names_of_options(*program.get_subcommand(*chosen));
        names.insert(names.begin(), own.begin(), own.end());
        help = "covol " + *chosen + " --help-all";
    }
    for (const std::string& word : words) {
        if (word.size() < 2 || word[0] != '-' || is_number(word)) continue;
        const std::string name = word.substr(0, word.find('='));
        const auto is_given = [&](const std::string& known) {
            // A short name may be followed by its value, or by other short flags, without a blank, as in -oOUT.vdb.
            return known == name || (known.size() == 2 && known[1] != '-' && name[1] != '-' && name.starts_with(known));
        };
        if (std::none_of(names.begin(), names.end(), is_given))
            return with_hint(name + " is not an option of covol" + (chosen != words.end() ? " " + *chosen : ""),
                             nearest(name, names), help);
    }
    return {};
}

void check_blanks(const std::vector<std::string>& words) {
    for (std::size_t n = 2; n < words.size(); ++n) {
        if (!is_number(words[n - 1]) || !words[n - 2].starts_with("--")) continue;
        const bool voxels = words[n] == "vx" || words[n] == "voxel" || words[n] == "voxels";
        const bool unit = words[n] == "nm" || words[n] == "um" || words[n] == "mm" || words[n] == "cm" ||
                          words[n] == "\xC2\xB5m" || words[n] == "m";
        std::error_code status;
        if ((!voxels && !unit) || std::filesystem::exists(words[n], status)) continue;
        const std::string got = ", got '" + words[n - 1] + " " + words[n] + "'";
        throw UsageError(words[n - 2] + ": " +
                         (voxels ? "expected a length in voxels without a blank, " + words[n - 1] + "vx" + got
                                 : "expected a number alone: lengths are in the unit of the input" + got));
    }
}

}  // namespace covol::tool
