#include "cli/options/config_file.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <istream>
#include <optional>
#include <string_view>
#include <utility>

#include "cli/options/arguments.h"
#include "cli/options/nearest.h"
#include "cli/options/parse_errors.h"
#include "covol/safe_text.h"

namespace covol::tool {
namespace {

constexpr std::size_t kMaxBytes = 1 << 20;

struct Entry {
    std::string section, name;
    std::vector<std::string> values;
    std::size_t line = 0;  ///< where it begins, from 1
};

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/// Parses one file from beginning to end, without recursion.
class Reader {
public:
    /// @param file  "--config FILE", which begins the messages
    Reader(std::string_view text, std::string file) : text_(text), file_(std::move(file)) {
        if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3;
    }

    /// The beginning of a message about a line.
    [[nodiscard]] std::string place(std::size_t line) const { return file_ + ": line " + std::to_string(line) + ": "; }

    std::optional<Entry> next() {
        while (skip_to_content()) {
            if (peek() != '[') return entry();
            section_ = section();
            end_line();
        }
        return {};
    }

private:
    [[nodiscard]] bool at_end() const { return at_ >= text_.size(); }
    [[nodiscard]] char peek() const { return at_end() ? '\n' : text_[at_]; }

    [[noreturn]] void fail(const std::string& what) const { throw UsageError(place(line_) + what); }

    void skip_blanks() {
        while (!at_end() && is_blank(text_[at_])) ++at_;
    }

    void skip_comment() {
        if (peek() == '#')
            while (peek() != '\n') ++at_;
    }

    /// Skips blanks, comments and empty lines. @return false at the end of the file
    bool skip_to_content() {
        for (;; ++at_, ++line_) {
            skip_blanks();
            if (peek() == ';')
                while (peek() != '\n') ++at_;
            skip_comment();
            if (at_end()) return false;
            if (peek() != '\n') return true;
        }
    }

    void end_line() {
        skip_blanks();
        skip_comment();
        if (peek() != '\n') fail("expected the end of the line, got '" + std::string(text_.substr(at_, 20)) + "'");
    }

    /// Reads the header of a section: [segment], [[segment]] or ["segment"].
    std::string section() {
        std::size_t brackets = 0;
        for (; peek() == '['; ++at_) ++brackets;
        skip_blanks();
        std::string name = peek() == '"' || peek() == '\'' ? quoted() : bare(" \t\r[]#");
        skip_blanks();
        for (std::size_t n = 0; n < brackets; ++n, ++at_)
            if (brackets > 2 || peek() != ']') fail("expected a section such as [segment]");
        return name == "default" ? "" : name;
    }

    Entry entry() {
        Entry found{section_, peek() == '"' || peek() == '\'' ? quoted() : bare(" \t\r=#"), {}, line_};
        if (found.name.empty()) fail("expected NAME = VALUE");
        // A name outside of sections may be prefixed by its section, as in "segment.theta = 0.5".
        if (const std::size_t dot = found.name.find('.'); dot != std::string::npos && found.section.empty()) {
            found.section = found.name.substr(0, dot);
            found.name.erase(0, dot + 1);
        }
        skip_blanks();
        if (peek() == '=') {
            ++at_;
            skip_blanks();
            found.values = peek() == '[' ? array() : values();
        } else {
            found.values = {"true"};
        }
        end_line();
        return found;
    }

    std::vector<std::string> array() {
        std::vector<std::string> list;
        for (++at_;;) {
            while (peek() == '\n' || is_blank(peek()) || peek() == '#') {
                if (at_end()) fail("expected ] at the end of a list");
                skip_comment();
                if (at_end()) continue;
                line_ += peek() == '\n' ? 1 : 0;
                ++at_;
            }
            if (peek() == ']') break;
            if (peek() == '[' || peek() == '{')
                fail("expected a list of texts and numbers, got a list or a table within it");
            list.push_back(peek() == '"' || peek() == '\'' ? quoted() : bare(" \t\r,]#"));
            skip_blanks();
            if (peek() == ',')
                ++at_;
            else if (peek() != ']' && peek() != '\n' && peek() != '#')
                fail("expected , or ] in a list");
        }
        ++at_;
        if (list.empty()) fail("expected a value, got an empty list");
        return list;
    }

    /// The values up to the end of the line, separated by blanks or commas. If there are none, as in
    /// "name =", the list contains one empty value.
    std::vector<std::string> values() {
        std::vector<std::string> list;
        for (; peek() != '\n' && peek() != '#'; skip_blanks()) {
            list.push_back(peek() == '"' || peek() == '\'' ? quoted() : bare(" \t\r,#"));
            skip_blanks();
            if (peek() == ',') ++at_;
        }
        if (list.empty()) list.emplace_back();
        return list;
    }

    std::string bare(const char* ends) {
        const std::size_t begin = at_;
        while (peek() != '\n' && std::string_view(ends).find(peek()) == std::string_view::npos) ++at_;
        return std::string(text_.substr(begin, at_ - begin));
    }

    std::string quoted() {
        const char quote = text_[at_++];
        std::string value;
        for (; peek() != quote; ++at_) {
            if (peek() == '\n') fail(std::string("expected ") + quote + " at the end of a text");
            if (quote == '"' && peek() == '\\')
                escape(value);
            else
                value += peek();
        }
        ++at_;
        if (std::string_view(" \t\r\n,]=#").find(peek()) == std::string_view::npos)
            fail("expected a blank or the end of the line after a text in quotes");
        return value;
    }

    /// Decodes the escape sequence at the current position, a backslash; ends at the last character of the sequence.
    void escape(std::string& value) {
        constexpr std::string_view kNames = "btnfr\"\\", kMeanings = "\b\t\n\f\r\"\\";
        ++at_;
        if (const std::size_t n = kNames.find(peek()); n != std::string_view::npos) {
            value += kMeanings[n];
            return;
        }
        const std::size_t digits = peek() == 'u' ? 4 : peek() == 'U' ? 8 : 0;
        const std::string_view number = text_.substr(std::min(at_ + 1, text_.size()), digits);
        std::uint32_t code = 0;
        const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), code, 16);
        const bool whole =
            digits > 0 && number.size() == digits && error == std::errc() && end == number.data() + number.size();
        if (!whole || code == 0 || code > 0x10FFFF || (code >= 0xD800 && code < 0xE000))
            fail(
                "a backslash in double quotes begins a TOML escape such as \\\\ or \\u00b5; use 'single quotes' for a "
                "text without escapes");
        add_utf8(code, value);
        at_ += digits;
    }

    static void add_utf8(std::uint32_t code, std::string& text) {
        const auto tail = [&](unsigned shift) { text += char(0x80U | (code >> shift & 0x3FU)); };
        if (code < 0x80) {
            text += char(code);
        } else if (code < 0x800) {
            text += char(0xC0U | code >> 6U);
            tail(0);
        } else if (code < 0x10000) {
            text += char(0xE0U | code >> 12U);
            tail(6);
            tail(0);
        } else {
            text += char(0xF0U | code >> 18U);
            tail(12);
            tail(6);
            tail(0);
        }
    }

    std::string_view text_;
    std::size_t at_ = 0, line_ = 1;
    std::string file_, section_;
};

std::string all_of(std::istream& input, const std::string& file) {
    std::string text(kMaxBytes + 1, '\0');
    input.read(text.data(), std::streamsize(text.size()));
    text.resize(std::size_t(input.gcount()));
    if (text.size() > kMaxBytes) throw UsageError(file + ": expected a file of options, got one of more than 1 MiB");
    return text;
}

/// The option of the command with this name; null if there is none. CLI11 also finds it by this name.
const CLI::Option* find_option(const CLI::App& command, const std::string& name) {
    std::vector<std::string> words{"--" + name, name};
    if (name.size() == 1) words.insert(words.begin() + 1, "-" + name);
    for (const std::string& word : words)
        if (const CLI::Option* const found = command.get_option_no_throw(word)) return found;
    return nullptr;
}

/// "; did you mean X?" if a name of the list is close to an unknown one.
std::string hint(const std::string& name, const std::vector<std::string>& known) {
    constexpr std::size_t kLongest = 60;  // no option and no command has a longer name
    const std::string close = name.size() > kLongest ? "" : nearest(name, known);
    return close.empty() ? "." : did_you_mean(close);
}

/// The option that an entry outside of sections, or in the section of the command, names.
/// @throws UsageError if there is none, or if it cannot be in a file
const CLI::Option& option_of(const Entry& entry, const CLI::App& command, const CLI::App& program,
                             const std::string& place) {
    const CLI::Option* const common = program.get_option_no_throw("--" + entry.name);
    const CLI::Option* const option =
        entry.section.empty() && common != nullptr ? common : find_option(command, entry.name);
    const std::string name = in_quotes(entry.name);
    if (option == nullptr && common != nullptr)
        throw UsageError(place + name + " is an option of every command; write it above the first [section]");
    if (option == nullptr) {
        std::vector<std::string> known;
        for (const CLI::App* app : {&command, &program})
            for (const CLI::Option* one : app->get_options())
                if (one->get_configurable()) known.push_back(one->get_single_name());
        throw UsageError(place + name + " is not an option of covol " + command.get_name() + hint(entry.name, known) +
                         " See covol " + command.get_name() + " --help-all");
    }
    if (!option->get_configurable())
        throw UsageError(place + name + " cannot be in a file; delete it there, and give it on the command line");
    return *option;
}

/// @throws UsageError for the name of a section that is no command, whose options would be ignored
void require_command(const std::string& section, const std::vector<const CLI::App*>& commands,
                     const std::string& place) {
    std::vector<std::string> known;
    for (const CLI::App* command : commands) known.push_back(command->get_name());
    if (std::find(known.begin(), known.end(), section) == known.end())
        throw UsageError(place + in_quotes(section) + " is not a command of covol" + hint(section, known) +
                         " Write options above the first [section], or in the section of their command");
}

void require_count(const CLI::Option& option, const CLI::ConfigItem& item, const std::string& place) {
    // An option takes one value, or any number.
    if (item.inputs.size() > std::size_t(std::max(1, option.get_items_expected_max())))
        throw UsageError(place + in_quotes(item.name) + ": expected one value, got " +
                         std::to_string(item.inputs.size()) +
                         "; give the option once, with quotes around a value that has blanks or commas");
}

/// Whether the value is a number or a Boolean, which TOML writes without quotes.
bool is_plain(const std::string& value) {
    if (value == "true" || value == "false") return true;
    double number = 0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
    const bool digit = !value.empty() && value.back() >= '0' && value.back() <= '9';
    return digit && error == std::errc() && end == value.data() + value.size();
}

/// The value as TOML: a basic string unless is_plain(). Characters that a shell would interpret within double quotes
/// are written as numeric escapes, so that a shell that reads the file executes no part of a value.
std::string toml_text(const std::string& value) {
    if (is_plain(value)) return value;
    std::string text = "\"";
    for (const char c : value) {
        const auto byte = static_cast<unsigned char>(c);
        char number[8];
        std::snprintf(number, sizeof number, "\\u%04x", unsigned(byte));
        if (byte < 0x20 || byte == 0x7F || c == '$' || c == '`' || c == '!')
            text += number;
        else
            text += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
    }
    return text + "\"";
}

}  // namespace

std::vector<CLI::ConfigItem> ConfigFile::from_config(std::istream& input) const {
    const std::vector<const CLI::App*> commands = program_.get_subcommands([](const CLI::App*) { return true; });
    const std::vector<CLI::App*> parsed = program_.get_subcommands();
    const CLI::App* const command = parsed.empty() ? nullptr : parsed.front();
    // More than one file of --config is refused before this function is called.
    const std::string file = "--config " + program_.get_config_ptr()->results().front(), text = all_of(input, file);
    std::vector<CLI::ConfigItem> items;
    std::map<const CLI::Option*, std::size_t> lines;
    const CLI::Option* last = nullptr;
    origins_.clear();
    Reader reader(text, file);
    while (std::optional<Entry> entry = reader.next()) {
        const std::string place = reader.place(entry->line);
        if (!entry->section.empty()) require_command(entry->section, commands, place);
        if (command == nullptr) continue;  // CLI11 reports this
        if (!entry->section.empty() && entry->section != command->get_name()) continue;
        const CLI::Option& option = option_of(*entry, *command, program_, place);
        const bool is_new = lines.emplace(&option, entry->line).second;
        // A list of values may be given by consecutive lines with the same name.
        if (!is_new && last != &option)
            throw UsageError(place + in_quotes(entry->name) + " is already given in line " +
                             std::to_string(lines.at(&option)) + "; give it once, with all its values");
        if (is_new) {
            CLI::ConfigItem item;
            if (&option != program_.get_option_no_throw("--" + entry->name)) item.parents = {command->get_name()};
            item.name = std::move(entry->name);
            items.push_back(std::move(item));
            if (option.count() == 0) origins_[&option] = place;
        }
        std::vector<std::string>& values = items.back().inputs;
        values.insert(values.end(), entry->values.begin(), entry->values.end());
        require_count(option, items.back(), place);
        last = &option;
    }
    return items;
}

std::string ConfigFile::origin(const CLI::Option& option) const {
    const auto found = origins_.find(&option);
    return found == origins_.end() ? "" : found->second;
}

std::string ConfigFile::to_config(const CLI::App* command, bool, bool, std::string) const {
    std::string text = "# " + command->get_description() + "\n";
    for (const CLI::Option* option : command->get_options()) {
        const std::vector<std::string> values = option->reduced_results();
        if (!option->get_configurable() || values.empty()) continue;
        text += "\n# " + option->get_description() + "\n" + option->get_single_name() + "=";
        std::string list;
        for (const std::string& value : values) list += (list.empty() ? "" : ",") + toml_text(value);
        text += (values.size() > 1 ? "[" + list + "]" : list) + "\n";
    }
    return text;
}

}  // namespace covol::tool
