#include "cli/options/config_file.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <istream>
#include <optional>
#include <string_view>
#include <utility>

#include "cli/options/arguments.h"
#include "covol/safe_text.h"

namespace covol::tool {
namespace {

constexpr std::size_t kMaxBytes = 1 << 20;

struct Entry {
    std::string section, name;
    std::vector<std::string> values;
};

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/// Parses one file from beginning to end, without recursion.
class Reader {
public:
    explicit Reader(std::string_view text) : text_(text) {
        if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3;
    }

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

    [[noreturn]] void fail(const std::string& what) const {
        throw UsageError("--config: line " + std::to_string(line_) + ": " + what);
    }

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
        Entry found{section_, peek() == '"' || peek() == '\'' ? quoted() : bare(" \t\r=#"), {}};
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
            if (peek() == '[' || peek() == '{') fail("expected a list of texts and numbers, got one within another");
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
    std::string section_;
};

std::string all_of(std::istream& input) {
    std::string text(kMaxBytes + 1, '\0');
    input.read(text.data(), std::streamsize(text.size()));
    text.resize(std::size_t(input.gcount()));
    if (text.size() > kMaxBytes) throw UsageError("--config: expected a file of options, got one of more than 1 MiB");
    return text;
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
    std::string command;
    for (const CLI::App* one : commands)
        if (program_.got_subcommand(const_cast<CLI::App*>(one))) command = one->get_name();
    const std::string text = all_of(input);
    std::vector<CLI::ConfigItem> items;
    Reader reader(text);
    while (std::optional<Entry> entry = reader.next()) {
        const bool is_common = entry->section.empty() && program_.get_option_no_throw("--" + entry->name) != nullptr;
        if (!entry->section.empty() && entry->section != command) continue;
        CLI::ConfigItem item;
        if (!is_common) item.parents = {command};
        item.name = std::move(entry->name);
        item.inputs = std::move(entry->values);
        // A list of values may be given by consecutive lines with the same name.
        if (!items.empty() && items.back().name == item.name && items.back().parents == item.parents)
            items.back().inputs.insert(items.back().inputs.end(), item.inputs.begin(), item.inputs.end());
        else
            items.push_back(std::move(item));
    }
    return items;
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
