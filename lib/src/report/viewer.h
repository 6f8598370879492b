#pragma once
#include <string_view>

namespace covol::detail {

/// The page without title and data, {{title}} and {{data}} in their places: lib/src/report/viewer.html, which
/// tools/viewer makes; the build embeds it.
[[nodiscard]] std::string_view viewer();

}  // namespace covol::detail
