#pragma once
#include <nlohmann/json.hpp>
#include <string_view>

namespace covol::detail {

/// One object that is not nested deeply; the text may come from anywhere. @throws Error InvalidInput.
[[nodiscard]] nlohmann::json parse_object(std::string_view text);

}  // namespace covol::detail
