#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace covol::tool {

using Json = nlohmann::ordered_json;

/// JSON from an untrusted file: at most 32 levels deep.
/// @param what  names the text in messages @throws Error InvalidInput.
[[nodiscard]] Json parse_json(const std::string& text, const std::string& what);

/// The same for a whole file. @throws Error InvalidInput, Io (not a regular file; more than `max_bytes`).
[[nodiscard]] Json read_json(const std::string& path, std::uintmax_t max_bytes);

}  // namespace covol::tool
