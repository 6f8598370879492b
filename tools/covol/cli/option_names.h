#pragma once
#include <string>

namespace covol::tool {

/// A message of the library, which names fields of options, with the flags that set them: "`tag_distance = 3`" becomes
/// "--tag-distance 3". What it says of anything else stays.
[[nodiscard]] std::string with_flags(const std::string& message);

}  // namespace covol::tool
