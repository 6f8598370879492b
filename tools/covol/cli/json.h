#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace covol::tool {

using Json = nlohmann::ordered_json;

/// JSON of a file that anybody may have written: nothing in it lies deeper than 32 levels.
/// @param what  names the text in messages @throws Error InvalidInput.
[[nodiscard]] Json parse_json(const std::string& text, const std::string& what);

/// The same of a whole file. @throws Error InvalidInput, Io (no regular file; more than so many bytes).
[[nodiscard]] Json read_json(const std::string& path, std::uintmax_t max_bytes);

}  // namespace covol::tool
