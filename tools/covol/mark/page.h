#pragma once
#include <string_view>

namespace covol::detail {

/// The page of `covol mark`, HTML: tools/covol/mark/mark.html, which tools/viewer makes; the build embeds it.
[[nodiscard]] std::string_view mark_page();

}  // namespace covol::detail
