#pragma once
#include <string>

namespace covol::tool {

/// "--tag-distance" of the option "tag_distance".
[[nodiscard]] std::string flag_of(const std::string& name);

/// A message of the library, which names options, with their flags: "`tag_distance = 3`" becomes "--tag-distance 3".
[[nodiscard]] std::string with_flags(const std::string& message);

}  // namespace covol::tool
