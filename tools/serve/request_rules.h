#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "serve/web_server.h"

// Decides which requests are answered: pure functions of what a client sent, without sockets.
namespace covol::serve {

/// The header of a request as received, without the blanks around values.
struct RequestHead {
    std::string_view method, target;
    std::vector<std::pair<std::string_view, std::string_view>> fields;  ///< names in any letter case, some repeated
    bool is_upgrade = false;                                            ///< the request is for a WebSocket
};

/// The values and limits that a request is checked against.
struct Rules {
    std::vector<std::string> authorities;  ///< values of `Host`, see allowed_authorities()
    std::string token;                     ///< secret in the link that the user opens
    std::string cookie_name, cookie;
    std::string live_path;
    std::size_t max_target_bytes = 4096;
    bool may_be_framed = false;      ///< pages of the same host on other ports may show the link in a frame
    std::size_t max_body_bytes = 0;  ///< maximum size of a POST's body; 0: all POSTs are refused
};

/// The decision about a request.
struct Decision {
    enum class Kind {
        Refuse,     ///< answer with `status` and `why`, and close the connection
        SetCookie,  ///< the token is correct: set the cookie, and redirect to "/"
        Get,        ///< let a handler answer
        Post,       ///< read `body_bytes`, and let a handler answer
        Live        ///< open a WebSocket
    };
    Kind kind = Kind::Refuse;
    int status = 400;
    std::string why{};           ///< of Refuse: message for the user
    Request request{};           ///< of Get and Post
    std::size_t body_bytes = 0;  ///< of Post, from 1 to Rules::max_body_bytes
    bool is_head = false;
    /// for SetCookie: the user followed a link on another page or in a file, or a page on another port loads this one
    /// into a frame
    bool is_link = false;
};

/// Applies all rules to a request. Handlers are called only if Host, Origin, Sec-Fetch-Site and either the token or the
/// cookie are correct. Links on other pages are accepted for the token's address only. A POST also has to state that it
/// comes from the server's own page, and the length of its body.
[[nodiscard]] Decision judge(const RequestHead& head, const Rules& rules);

/// 127.0.0.1 and localhost with this port, and those in `further`, in the form that browsers send: in lower case, and
/// without the port if it is 80. @pre is_authority() is true for each text in `further`
[[nodiscard]] std::vector<std::string> allowed_authorities(std::uint16_t port, const std::vector<std::string>& further);

/// Whether the text is `name`, `name:port`, `[IPv6]` or `[IPv6]:port` with a port from 1 to 65535.
[[nodiscard]] bool is_authority(std::string_view text);

/// The parts of "/path?name=value&name=value", decoded. nullopt if the text is invalid: a wrong or incomplete escape, a
/// NUL or invalid UTF-8, a control character in the path, a parameter without a name or without '=', a repeated name, a
/// fragment, or a character that has to be escaped. '+' is a blank in the query, as in forms.
[[nodiscard]] std::optional<Request> parse_target(std::string_view target);

/// Whether one of the cookies with this name in the value of a `Cookie` field is the secret. Pages on other ports of
/// this machine may have set further cookies of the same name, for other paths.
[[nodiscard]] bool has_cookie(std::string_view field, std::string_view name, std::string_view secret);

/// Whether the bytes are UTF-8: no overlong forms, no surrogates, nothing above U+10FFFF.
[[nodiscard]] bool is_utf8(std::string_view text);

}  // namespace covol::serve
