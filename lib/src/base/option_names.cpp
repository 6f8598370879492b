#include "covol/option_names.h"

#include <algorithm>
#include <optional>
#include <string_view>

namespace covol {
namespace {

constexpr std::string_view kBeforeValue = " = ", kBetween = ", ";

/// Converts the text between two backquotes by `spell`; none if the text does not consist of option names.
std::optional<std::string> spelled(std::string_view text, const SpellOption& spell) {
    std::string all;
    for (bool more = true; more;) {
        const std::size_t end = text.find(kBetween);
        const std::string_view one = text.substr(0, end);
        const std::size_t sign = one.find(kBeforeValue);
        const std::string name(one.substr(0, sign));
        const std::string value(sign == std::string_view::npos ? "" : one.substr(sign + kBeforeValue.size()));
        const auto is_of_name = [](char c) { return (c >= 'a' && c <= 'z') || c == '_'; };
        if (name.empty() || !std::all_of(name.begin(), name.end(), is_of_name)) return std::nullopt;
        if (sign != std::string_view::npos && value.empty()) return std::nullopt;
        all += (all.empty() ? "" : " ") + spell(name, value);
        more = end != std::string_view::npos;
        if (more) text.remove_prefix(end + kBetween.size());
    }
    return all;
}

}  // namespace

std::string replace_names(const std::string& message, const SpellOption& spell) {
    std::string result;
    for (std::size_t at = 0;;) {
        const std::size_t begin = message.find('`', at);
        const std::size_t end = begin == std::string::npos ? begin : message.find('`', begin + 1);
        result.append(message, at, begin - at);
        if (end == std::string::npos) return begin == end ? result : result.append(message, begin);
        const auto named = spelled(std::string_view(message).substr(begin + 1, end - begin - 1), spell);
        // If the text does not consist of option names, the second backquote may begin another pair. The search
        // therefore continues at that backquote.
        result += named ? *named : message.substr(begin, end - begin);
        at = named ? end + 1 : end;
    }
}

}  // namespace covol
