#include "covol/option_names.h"

#include <algorithm>
#include <optional>
#include <string_view>

#include "covol/error.h"

namespace covol {
namespace {

constexpr std::string_view kBeforeValue = " = ", kBetween = ", ";

/// "a = 1, b"; nothing of text that names no options.
std::optional<std::vector<NamedOption>> parse(std::string_view text) {
    std::vector<NamedOption> options;
    for (bool more = true; more;) {
        const std::size_t end = text.find(kBetween);
        const std::string_view one = text.substr(0, end);
        const std::size_t sign = one.find(kBeforeValue);
        NamedOption option{std::string(one.substr(0, sign)), ""};
        if (sign != std::string_view::npos) option.value = one.substr(sign + kBeforeValue.size());
        const auto is_of_name = [](char c) { return (c >= 'a' && c <= 'z') || c == '_'; };
        if (option.field.empty() || !std::all_of(option.field.begin(), option.field.end(), is_of_name))
            return std::nullopt;
        if (sign != std::string_view::npos && option.value.empty()) return std::nullopt;
        options.push_back(std::move(option));
        more = end != std::string_view::npos;
        if (more) text.remove_prefix(end + kBetween.size());
    }
    return options;
}

/// Calls text(part) and options(list) for the parts of a message, in order.
template <typename Text, typename Options>
void walk(std::string_view message, const Text& text, const Options& options) {
    while (!message.empty()) {
        const std::size_t begin = message.find('`');
        const std::size_t end = begin == std::string_view::npos ? begin : message.find('`', begin + 1);
        if (end == std::string_view::npos) return text(message);
        text(message.substr(0, begin));
        const auto named = parse(message.substr(begin + 1, end - begin - 1));
        if (named)
            options(*named);
        else
            text(message.substr(begin, end - begin));  // its second mark may be the first of a pair
        message.remove_prefix(named ? end + 1 : end);
    }
}

}  // namespace

std::vector<NamedOption> find_named_options(const std::string& message) {
    std::vector<NamedOption> all;
    walk(
        message, [](std::string_view) {},
        [&](const auto& named) { all.insert(all.end(), named.begin(), named.end()); });
    return all;
}

std::string replace_names(const std::string& message, const std::function<std::string(const NamedOption&)>& name) {
    std::string result;
    walk(
        message, [&](std::string_view text) { result += text; },
        [&](const auto& named) {
            for (std::size_t n = 0; n < named.size(); ++n) result += (n == 0 ? "" : " ") + name(named[n]);
        });
    return result;
}

std::string Error::option() const {
    const std::vector<NamedOption> named = find_named_options(what());
    return named.empty() ? "" : named.front().field;
}

}  // namespace covol
