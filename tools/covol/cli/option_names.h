#pragma once
#include <string>

#include "covol/option_names.h"

namespace covol::tool {

/// A message of the library, which names fields of options, with the flags that set them: "`tag_distance = 3`" becomes
/// "--tag-distance 3". What it says of anything else stays.
[[nodiscard]] std::string with_flags(const std::string& message);

/// "--tag-distance" of "tag_distance"; empty where there is none.
[[nodiscard]] std::string flag_of(const std::string& field);
/// Choices are enumerators in the library's messages, and words in lower case here.
[[nodiscard]] std::string value_of(const NamedOption& option);

}  // namespace covol::tool
