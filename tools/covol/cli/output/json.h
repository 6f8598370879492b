#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace covol::tool {

using Json = nlohmann::ordered_json;

/// Parses JSON from an untrusted file, at most 32 levels deep.
/// @param what  name of the text in error messages @throws Error InvalidInput.
[[nodiscard]] Json parse_json(const std::string& text, const std::string& what);

/// Parses a file like parse_json(). @throws Error InvalidInput, Io (not a regular file; more than `max_bytes`).
[[nodiscard]] Json read_json(const std::string& path, std::uintmax_t max_bytes);

}  // namespace covol::tool
