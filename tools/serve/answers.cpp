#include "serve/answers.h"

#include <algorithm>
#include <array>

namespace covol::serve {
namespace {

bool is_letter_or_digit(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'); }

// Whether the text is a token by RFC 9110, 5.6.2.
bool is_header_name(std::string_view text) {
    constexpr std::string_view kSigns = "!#$%&'*+-.^_`|~";
    return !text.empty() && std::all_of(text.begin(), text.end(), [&](char c) {
        return is_letter_or_digit(c) || kSigns.find(c) != std::string_view::npos;
    });
}

std::string in_small_letters(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; });
    return text;
}

// Whether handlers must not set this header, because it describes the body or the connection, or protects the page.
bool is_server_header(const std::string& name) {
    static const Headers own = protecting_headers({});
    constexpr std::array<std::string_view, 9> kFraming{"connection",     "content-disposition", "content-encoding",
                                                       "content-length", "content-type",        "keep-alive",
                                                       "set-cookie",     "transfer-encoding",   "upgrade"};
    const std::string small = in_small_letters(name);
    return std::find(kFraming.begin(), kFraming.end(), small) != kFraming.end() ||
           std::any_of(own.begin(), own.end(),
                       [&](const auto& header) { return in_small_letters(header.first) == small; });
}

}  // namespace

Headers protecting_headers(const std::string& policy) {
    return {{"X-Content-Type-Options", "nosniff"},
            {"X-Frame-Options", "DENY"},
            {"Cross-Origin-Resource-Policy", "same-origin"},
            {"Cross-Origin-Opener-Policy", "same-origin"},
            {"Referrer-Policy", "no-referrer"},
            {"Cache-Control", "no-store"},
            {"Content-Security-Policy", policy},
            {"Server", "covol"}};
}

std::string why_unsendable(const Response& response) {
    if (response.status < 200 || response.status > 599) {
        return "status: expected 200 to 599, got " + std::to_string(response.status);
    }
    if (response.type.empty() || !is_header_value(response.type)) return "type: expected one line";
    for (const auto& [name, value] : response.headers) {
        if (!is_header_name(name)) return "a header's name contains characters that are not allowed";
        if (!is_header_value(value)) return name + ": expected one line without control characters";
        if (is_server_header(name)) return name + ": is set by the server alone";
    }
    return {};
}

Headers headers_of(const Response& response, const std::string& page_policy) {
    const std::string type = in_small_letters(response.type.substr(0, response.type.find_first_of("; \t")));
    Headers all = protecting_headers(type == "text/html" ? page_policy : "default-src 'none'");
    all.emplace_back("Content-Type", response.type);
    if (response.is_deflated) all.emplace_back("Content-Encoding", "deflate");
    if (!response.file_name.empty()) all.emplace_back("Content-Disposition", attachment(response.file_name));
    all.insert(all.end(), response.headers.begin(), response.headers.end());
    return all;
}

Response refusal(int status, const std::string& why) {
    Response response;
    response.status = status;
    response.body = why + "\n";
    if (status == 405) response.headers.emplace_back("Allow", "GET, HEAD");
    if (status == 426) response.headers.emplace_back("Upgrade", "websocket");
    return response;
}

Response cookie_answer(const std::string& cookie_name, const std::string& cookie, bool is_link) {
    Response response;
    if (is_link) {
        // The answer is a page that loads "/", and not a redirection: a browser would treat a redirected request as one
        // of the linking page, and not send the cookie with it (SameSite=Strict).
        response.type = "text/html; charset=utf-8";
        response.body =
            "<!doctype html>\n<title>covol</title><meta http-equiv=\"refresh\" content=\"0;url=/\"><a "
            "href=\"/\">covol</a>\n";
    } else {
        response.status = 303;
        response.body = "The page is at /\n";
        response.headers.emplace_back("Location", "/");
    }
    response.headers.emplace_back("Set-Cookie", cookie_name + "=" + cookie + "; HttpOnly; SameSite=Strict; Path=/");
    return response;
}

std::string attachment(std::string_view file_name) {
    std::string name(file_name);
    // Control characters, slashes and a leading dot are replaced. Browsers replace most of them themselves, but other
    // programs that download files may not.
    for (char& c : name) {
        if ((c >= 0 && c < ' ') || c == '\x7f' || c == '/' || c == '\\') c = '_';
    }
    if (!name.empty() && name[0] == '.') name[0] = '_';
    std::string plain, coded;
    constexpr std::string_view kDigits = "0123456789ABCDEF", kPlain = " ._-", kCoded = "!#$&+-.^_`|~";
    for (const char c : name) {
        const bool is_simple = is_letter_or_digit(c);
        plain += is_simple || kPlain.find(c) != std::string_view::npos ? c : '_';
        if (is_simple || kCoded.find(c) != std::string_view::npos) {
            coded += c;
        } else {
            const auto byte = static_cast<unsigned char>(c);
            coded += {'%', kDigits[byte >> 4], kDigits[byte & 15]};
        }
    }
    return "attachment; filename=\"" + plain + "\"; filename*=UTF-8''" + coded;
}

bool is_header_value(std::string_view text) {
    return std::all_of(text.begin(), text.end(),
                       [](char c) { return c == '\t' || (static_cast<unsigned char>(c) >= ' ' && c != '\x7f'); });
}

}  // namespace covol::serve
