#pragma once
#include <nlohmann/json.hpp>
#include <string_view>

namespace covol::detail {

/// Parses one object without deep nesting; the text may be untrusted. @throws Error InvalidInput.
[[nodiscard]] nlohmann::json parse_object(std::string_view text);

}  // namespace covol::detail
