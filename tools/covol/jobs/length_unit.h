#pragma once
#include <map>
#include <optional>
#include <string>

namespace covol::tool {

/// Metres in a unit of length, by its name in images; nullopt for an unknown name.
[[nodiscard]] inline std::optional<double> metres_in(const std::string& unit) {
    static const std::map<std::string, double> metres{{"nm", 1e-9}, {"um", 1e-6}, {"mm", 1e-3}, {"cm", 1e-2}, {"m", 1}};
    const auto found = metres.find(unit);
    return found != metres.end() ? std::optional(found->second) : std::nullopt;
}

}  // namespace covol::tool
