#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "serve/web_server.h"

// Which requests are answered: pure functions of what a client sent, without sockets.
namespace covol::serve {

/// The first lines of a request as they came, with the blanks around values removed.
struct RequestHead {
    std::string_view method, target;
    std::vector<std::pair<std::string_view, std::string_view>> fields;  ///< names in any case, some perhaps twice
    bool is_upgrade = false;                                            ///< it asks for a WebSocket
};

/// What a request is compared with.
struct Rules {
    std::vector<std::string> authorities;  ///< values of `Host`, see allowed_authorities()
    std::string token;                     ///< of the link that a person opens
    std::string cookie_name, cookie;
    std::string live_path;
    std::size_t max_target_bytes = 4096;
    bool may_be_framed = false;      ///< pages of the same host, on other ports, may show the link in a frame
    std::size_t max_body_bytes = 0;  ///< of a POST; 0: none is answered
};

/// What to do with a request.
struct Judgement {
    enum class Kind {
        Refuse,     ///< answer with `status` and `why`, and close the connection
        SetCookie,  ///< the right token: set the cookie, and lead to "/"
        Get,        ///< let a handler answer
        Post,       ///< read `body_bytes`, and let a handler answer
        Live        ///< open a WebSocket
    };
    Kind kind = Kind::Refuse;
    int status = 400;
    std::string why{};           ///< for people
    Request request{};           ///< of Get and Post
    std::size_t body_bytes = 0;  ///< of Post, from 1 to Rules::max_body_bytes
    bool is_head = false;
    bool is_link = false;  ///< of SetCookie: a person followed a link of another page, or of a file, to get here
};

/// Applies all rules to a request. No handler hears of one before Host, Origin, Sec-Fetch-Site and either the token or
/// the cookie are right. Links of other pages lead to the token's address alone. A POST also has to say that it comes
/// from the server's own page, and how long its body is.
[[nodiscard]] Judgement judge(const RequestHead& head, const Rules& rules);

/// 127.0.0.1 and localhost with this port, and the further ones as browsers write them: in small letters, and without
/// the port where it is 80. @pre each further one is_authority()
[[nodiscard]] std::vector<std::string> allowed_authorities(std::uint16_t port, const std::vector<std::string>& further);

/// Whether it is `name`, `name:port`, `[IPv6]` or `[IPv6]:port` with a port from 1 to 65535.
[[nodiscard]] bool is_authority(std::string_view text);

/// The parts of "/path?name=value&name=value", decoded. Nothing where it is no such text: a wrong or half escape, a NUL
/// or text that is no UTF-8, a control character in the path, a parameter without a name or without '=', one name
/// twice, a fragment, a character that has to be escaped. '+' is a blank in the query, as forms write it.
[[nodiscard]] std::optional<Request> parse_target(std::string_view target);

/// Whether one of the cookies of this name in the value of a `Cookie` field is the secret. Pages on other ports of this
/// machine may have set further ones of the same name, for other paths.
[[nodiscard]] bool has_cookie(std::string_view field, std::string_view name, std::string_view secret);

/// Whether the bytes are UTF-8: no overlong forms, no surrogates, nothing above U+10FFFF.
[[nodiscard]] bool is_utf8(std::string_view text);

}  // namespace covol::serve
