#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

// Encodings of bytes as text for a page.
namespace covol::detail {

/// Base64 according to RFC 4648, with padding.
[[nodiscard]] std::string to_base64(const std::uint8_t* data, std::size_t count);
/// A zlib stream (RFC 1950). @param level  1: fast, to 9: small
[[nodiscard]] std::string deflated(const std::vector<std::uint8_t>& bytes, int level);
/// A zlib stream as base64.
[[nodiscard]] std::string pack(const std::vector<std::uint8_t>& bytes);

/// JSON text for a script element: no character in it ends the element or begins a comment.
[[nodiscard]] std::string safe_in_script(std::string_view json);
/// Text for use between HTML tags, or in an attribute's quotes.
[[nodiscard]] std::string escape_html(std::string_view text);

}  // namespace covol::detail
