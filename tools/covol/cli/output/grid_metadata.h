#pragma once
#include <map>
#include <string>

#include "covol/fwd.h"

namespace covol::tool {

/// The metadata of a grid as strings, by name.
[[nodiscard]] std::map<std::string, std::string> text_metadata(const FloatGrid& grid);

}  // namespace covol::tool
