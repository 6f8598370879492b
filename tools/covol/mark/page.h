#pragma once
#include <string_view>

namespace covol::detail {

/// The page of `covol mark`, HTML: tools/covol/mark/mark.html, which tools/viewer generates and the build embeds.
[[nodiscard]] std::string_view mark_page();

}  // namespace covol::detail
