#pragma once
#include <string_view>

namespace covol::detail {

/// The page with {{title}} and {{data}} in place of title and data: lib/src/report/viewer.html, made by tools/viewer
/// and embedded by the build.
[[nodiscard]] std::string_view viewer();

}  // namespace covol::detail
