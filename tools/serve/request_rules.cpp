#include "serve/request_rules.h"

#include <algorithm>
#include <charconv>

#include "serve/secret.h"

namespace covol::serve {
namespace {

// Used instead of the functions of <cctype>, which depend on the locale.
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
char small(char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; }

bool is_same_name(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) { return small(x) == small(y); });
}

std::vector<std::string_view> values_of(const RequestHead& head, std::string_view name) {
    std::vector<std::string_view> values;
    for (const auto& [field, value] : head.fields) {
        if (is_same_name(field, name)) values.push_back(value);
    }
    return values;
}

int hex_value(char c) {
    if (is_digit(c)) return c - '0';
    c = small(c);
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

// Decodes escapes (%20). Nullopt if one is invalid, or if the result is not UTF-8 or contains a NUL.
std::optional<std::string> decode(std::string_view text, bool is_query) {
    std::string decoded;
    for (std::size_t n = 0; n < text.size(); ++n) {
        char c = text[n];
        if (c == '%') {
            if (text.size() - n < 3) return std::nullopt;
            const int high = hex_value(text[n + 1]), low = hex_value(text[n + 2]);
            if (high < 0 || low < 0) return std::nullopt;
            c = static_cast<char>(high * 16 + low);
            n += 2;
        } else if (c == '+' && is_query) {
            c = ' ';
        }
        if (c == '\0') return std::nullopt;
        decoded += c;
    }
    if (!is_utf8(decoded)) return std::nullopt;
    return decoded;
}

bool parse_query(std::string_view text, std::map<std::string, std::string>& query) {
    while (true) {
        const std::size_t end = std::min(text.find('&'), text.size());
        const std::string_view pair = text.substr(0, end);
        const std::size_t equals = pair.find('=');
        if (equals == std::string_view::npos || equals == 0) return false;
        auto name = decode(pair.substr(0, equals), true), value = decode(pair.substr(equals + 1), true);
        if (!name || !value || !query.try_emplace(std::move(*name), std::move(*value)).second) return false;
        if (end == text.size()) return true;
        text.remove_prefix(end + 1);
    }
}

Decision refuse(int status, std::string why) { return {Decision::Kind::Refuse, status, std::move(why)}; }

// Determines the length of a POST's body and stores it in `body_bytes`.
Decision judge_body(const std::vector<std::string_view>& lengths, const Rules& rules) {
    if (lengths.size() != 1) return refuse(411, "Content-Length: expected it once.");
    std::size_t bytes = 0;
    const char* const end = lengths[0].data() + lengths[0].size();
    const auto [last, status] = std::from_chars(lengths[0].data(), end, bytes);
    if (last != end || lengths[0].empty() || status == std::errc::invalid_argument)
        return refuse(400, "Content-Length: expected one number.");
    if (status != std::errc() || bytes > rules.max_body_bytes)
        return refuse(413, "A file may have at most " + std::to_string(rules.max_body_bytes) + " bytes here.");
    if (bytes == 0) return refuse(400, "Content-Length: expected a file that is not empty.");
    Decision good;
    good.kind = Decision::Kind::Post;
    good.body_bytes = bytes;
    return good;
}

// Checks the form of a request, not where it comes from. Returns Get or Post if the form is valid.
Decision judge_form(const RequestHead& head, const Rules& rules) {
    const bool is_post = head.method == "POST" && rules.max_body_bytes > 0;
    if (head.method != "GET" && head.method != "HEAD" && !is_post)
        return refuse(405, "Only GET and HEAD are allowed here.");
    if (head.target.size() > rules.max_target_bytes) {
        return refuse(414, "An address may have at most " + std::to_string(rules.max_target_bytes) + " bytes.");
    }
    if (!values_of(head, "Transfer-Encoding").empty()) return refuse(400, "Requests must not have a body here.");
    if (is_post) return judge_body(values_of(head, "Content-Length"), rules);
    if (const auto lengths = values_of(head, "Content-Length"); !lengths.empty()) {
        const bool is_number =
            lengths.size() == 1 && !lengths[0].empty() && std::all_of(lengths[0].begin(), lengths[0].end(), is_digit);
        if (!is_number) return refuse(400, "Content-Length: expected one number.");
        if (lengths[0].find_first_not_of('0') != std::string_view::npos) {
            return refuse(413, "Requests must not have a body here.");
        }
    }
    Decision good;
    good.kind = Decision::Kind::Get;
    return good;
}

bool has_value(const RequestHead& head, std::string_view name, std::string_view value) {
    const auto values = values_of(head, name);
    return values.size() == 1 && values[0] == value;
}

// Whether the user followed a link on another page, or a page on another port loads this one into a frame. A link
// replaces the whole window, so that the linking page cannot read the answer. The policy of the page controls which
// pages may show it in a frame; in frames of pages on other hosts, browsers would not send the cookie.
bool is_link(const RequestHead& head, const Rules& rules) {
    if (rules.may_be_framed && has_value(head, "Sec-Fetch-Site", "same-site") &&
        has_value(head, "Sec-Fetch-Mode", "navigate") && has_value(head, "Sec-Fetch-Dest", "iframe"))
        return true;
    return (has_value(head, "Sec-Fetch-Site", "cross-site") || has_value(head, "Sec-Fetch-Site", "same-site")) &&
           has_value(head, "Sec-Fetch-Mode", "navigate") && has_value(head, "Sec-Fetch-Dest", "document");
}

// Whether the request is for this server, and comes from one of its own pages or from no page.
Decision judge_source(const RequestHead& head, const Rules& rules, bool may_be_link, bool is_post) {
    const auto hosts = values_of(head, "Host");
    if (hosts.size() != 1) return refuse(400, "Host: expected it once.");
    if (std::find(rules.authorities.begin(), rules.authorities.end(), hosts[0]) == rules.authorities.end()) {
        return refuse(403, "This server does not answer under that name.");
    }
    const auto origins = values_of(head, "Origin");
    // Browsers send Origin with each WebSocket and each POST, and for the page itself it matches Host.
    const bool is_own = origins.size() == 1 && origins[0] == "http://" + std::string(hosts[0]);
    if (!is_own && (head.is_upgrade || is_post || !origins.empty())) {
        return refuse(403, "Requests from pages of other servers are refused.");
    }
    const auto sites = values_of(head, "Sec-Fetch-Site");
    const bool is_own_site = sites.size() == 1 && (sites[0] == "same-origin" || sites[0] == "none");
    if (!sites.empty() && !is_own_site && !may_be_link) {
        return refuse(403, "Links from other pages are refused: open the link that was printed at the start.");
    }
    Decision good;
    good.kind = Decision::Kind::Get;
    return good;
}

bool is_known(const RequestHead& head, const Rules& rules) {
    const auto cookies = values_of(head, "Cookie");
    return std::any_of(cookies.begin(), cookies.end(),
                       [&](std::string_view field) { return has_cookie(field, rules.cookie_name, rules.cookie); });
}

}  // namespace

Decision judge(const RequestHead& head, const Rules& rules) {
    const Decision form = judge_form(head, rules);
    if (form.kind == Decision::Kind::Refuse) return form;
    const bool is_post = form.kind == Decision::Kind::Post;
    std::optional<Request> request = parse_target(head.target);
    const bool has_token =
                   request && request->path == "/" && request->query.contains("token") && !head.is_upgrade && !is_post,
               follows_link = has_token && is_link(head, rules);
    if (Decision source = judge_source(head, rules, follows_link, is_post); source.kind == Decision::Kind::Refuse)
        return source;
    if (has_token) {
        if (!is_same_secret(rules.token, request->query["token"])) {
            return refuse(403, "This link belongs to another run. Open the one that was printed last.");
        }
        if (request->query.size() != 1) return refuse(400, "Nothing except the token is expected in this address.");
        Decision first;
        first.kind = Decision::Kind::SetCookie;
        first.is_head = head.method == "HEAD";
        first.is_link = follows_link;
        return first;
    }
    if (!is_known(head, rules)) {
        return refuse(403, "This browser has not been admitted. Open the link that was printed at the start.");
    }
    if (!request) return refuse(400, "This address is malformed.");
    const bool is_live = request->path == rules.live_path;
    if (head.is_upgrade && (!is_live || head.method != "GET"))
        return refuse(404, "There is no WebSocket at this address.");
    if (!head.is_upgrade && is_live) return refuse(426, "This address is for WebSockets.");
    Decision good;
    good.kind = is_live ? Decision::Kind::Live : form.kind;
    good.body_bytes = form.body_bytes;
    good.is_head = head.method == "HEAD";
    good.request = std::move(*request);
    return good;
}

bool is_authority(std::string_view text) {
    const auto is_port = [](std::string_view digits) {
        unsigned port = 0;
        const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
        return status == std::errc() && end == digits.data() + digits.size() && digits[0] != '0' && port <= 65535;
    };
    if (text.empty()) return false;
    std::size_t end = 0;
    if (text[0] == '[') {
        end = text.find(']');
        if (end == std::string_view::npos || end == 1) return false;
        const std::string_view address = text.substr(1, end - 1);
        if (!std::all_of(address.begin(), address.end(),
                         [](char c) { return hex_value(c) >= 0 || c == ':' || c == '.'; })) {
            return false;
        }
        ++end;
    } else {
        end = std::min(text.find(':'), text.size());
        const std::string_view name = text.substr(0, end);
        if (name.empty() || !std::all_of(name.begin(), name.end(), [](char c) {
                return is_letter(c) || is_digit(c) || c == '.' || c == '-' || c == '_';
            })) {
            return false;
        }
    }
    return end == text.size() || (text[end] == ':' && is_port(text.substr(end + 1)));
}

std::vector<std::string> allowed_authorities(std::uint16_t port, const std::vector<std::string>& further) {
    const std::string ending = ":" + std::to_string(port);
    std::vector<std::string> all{"127.0.0.1" + ending, "localhost" + ending};
    all.insert(all.end(), further.begin(), further.end());
    for (std::string& one : all) {
        std::transform(one.begin(), one.end(), one.begin(), small);
        constexpr std::string_view kDefault = ":80";
        if (one.ends_with(kDefault)) one.resize(one.size() - kDefault.size());
    }
    return all;
}

std::optional<Request> parse_target(std::string_view target) {
    const auto is_written_plainly = [](char c) {
        return c > ' ' && c < '\x7f' && c != '#' && c != '"' && c != '<' && c != '>';
    };
    if (target.empty() || target[0] != '/') return std::nullopt;
    if (!std::all_of(target.begin(), target.end(), is_written_plainly)) return std::nullopt;
    const std::size_t end = std::min(target.find('?'), target.size());
    auto path = decode(target.substr(0, end), false);
    if (!path) return std::nullopt;
    if (std::any_of(path->begin(), path->end(), [](char c) { return (c >= 0 && c < ' ') || c == '\x7f'; })) {
        return std::nullopt;
    }
    Request request;
    request.path = std::move(*path);
    if (target.size() - end > 1 && !parse_query(target.substr(end + 1), request.query)) return std::nullopt;
    return request;
}

bool has_cookie(std::string_view field, std::string_view name, std::string_view secret) {
    bool is_there = false;
    while (!field.empty()) {
        const std::size_t end = std::min(field.find(';'), field.size());
        std::string_view cookie = field.substr(0, end);
        field.remove_prefix(std::min(end + 1, field.size()));
        while (!cookie.empty() && (cookie.front() == ' ' || cookie.front() == '\t')) cookie.remove_prefix(1);
        while (!cookie.empty() && (cookie.back() == ' ' || cookie.back() == '\t')) cookie.remove_suffix(1);
        const std::size_t equals = cookie.find('=');
        if (equals == std::string_view::npos || cookie.substr(0, equals) != name) continue;
        if (is_same_secret(secret, cookie.substr(equals + 1))) is_there = true;
    }
    return is_there;
}

bool is_utf8(std::string_view text) {
    for (std::size_t n = 0; n < text.size();) {
        const unsigned first = static_cast<unsigned char>(text[n++]);
        if (first < 0x80) continue;
        const std::size_t more = first >= 0xF0 ? 3 : first >= 0xE0 ? 2 : 1;
        if (first < 0xC2 || first > 0xF4 || text.size() - n < more) return false;
        // The range of the second byte excludes overlong forms, surrogates and values above U+10FFFF.
        unsigned low = 0x80, high = 0xBF;
        if (first == 0xE0) low = 0xA0;
        if (first == 0xED) high = 0x9F;
        if (first == 0xF0) low = 0x90;
        if (first == 0xF4) high = 0x8F;
        for (std::size_t k = 0; k < more; ++k) {
            const unsigned byte = static_cast<unsigned char>(text[n++]);
            if (byte < low || byte > high) return false;
            low = 0x80, high = 0xBF;
        }
    }
    return true;
}

}  // namespace covol::serve
