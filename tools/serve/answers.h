#pragma once
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "serve/web_server.h"

// What stands above each answer: pure functions without sockets.
namespace covol::serve {

using Headers = std::vector<std::pair<std::string, std::string>>;

/// Those of every answer, of refusals and handshakes too; `policy` is the Content-Security-Policy.
[[nodiscard]] Headers protecting_headers(const std::string& policy);

/// Empty where a handler may answer this, else why not: a status, a type or a header that cannot be sent, or a header
/// that is the server's own to set.
[[nodiscard]] std::string why_unsendable(const Response& response);

/// All of an answer but its length and what concerns the connection.
/// @param page_policy  for text/html; all else may load nothing
[[nodiscard]] Headers headers_of(const Response& response, const std::string& page_policy);

/// A text for people, one line.
[[nodiscard]] Response refusal(int status, const std::string& why);

/// The answer to the right token. @param is_link  as Judgement::is_link
[[nodiscard]] Response cookie_answer(const std::string& cookie_name, const std::string& cookie, bool is_link);

/// The value of Content-Disposition that has a browser save a file, by RFC 6266 with the name as RFC 5987 codes it.
/// What could lead out of a folder, or hide, becomes '_'.
[[nodiscard]] std::string attachment(std::string_view file_name);

/// Whether it can be a header's value: visible ASCII, blanks and bytes above 127, no line ends.
[[nodiscard]] bool is_header_value(std::string_view text);

}  // namespace covol::serve
