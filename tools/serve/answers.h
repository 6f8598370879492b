#pragma once
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "serve/web_server.h"

// HTTP responses and their headers: pure functions that use no sockets.
namespace covol::serve {

using Headers = std::vector<std::pair<std::string, std::string>>;

/// The headers of every answer, including refusals and handshakes; `policy` is the Content-Security-Policy.
[[nodiscard]] Headers protecting_headers(const std::string& policy);

/// Empty if a handler may send this response, otherwise the reason: an invalid status, type or header, or a header that
/// only the server may set.
[[nodiscard]] std::string why_unsendable(const Response& response);

/// All headers of an answer except its length and those of the connection.
/// @param page_policy  Content-Security-Policy of text/html; that of other types forbids to load anything
[[nodiscard]] Headers headers_of(const Response& response, const std::string& page_policy);

/// A response with a message of one line.
[[nodiscard]] Response refusal(int status, const std::string& why);

/// The answer to a request with the correct token. @param is_link  see Decision::is_link
[[nodiscard]] Response cookie_answer(const std::string& cookie_name, const std::string& cookie, bool is_link);

/// The value of Content-Disposition that makes a browser save a file, by RFC 6266 with the name encoded as in RFC 5987.
/// Characters that could refer to another folder, or hide the file, become '_'.
[[nodiscard]] std::string attachment(std::string_view file_name);

/// Whether the text can be a header's value: visible ASCII, blanks and bytes above 127, no line ends.
[[nodiscard]] bool is_header_value(std::string_view text);

}  // namespace covol::serve
