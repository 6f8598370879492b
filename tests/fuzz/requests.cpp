// Fuzzes the rules by which the server of `covol mark` accepts or refuses requests, with libFuzzer, clang's
// coverage-guided fuzzer.
//
// The input is the head of an HTTP request: a first line and fields. Findings are reports of a sanitizer, and accepted
// requests that violate a rule.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "serve/answers.h"
#include "serve/request_rules.h"

namespace {

using namespace covol::serve;

void require(bool is_right) {
    if (!is_right) std::abort();
}

std::string_view take_line(std::string_view& text) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    return line;
}

std::string_view take_word(std::string_view& line) {
    const std::size_t end = std::min(line.find(' '), line.size());
    const std::string_view word = line.substr(0, end);
    line.remove_prefix(std::min(end + 1, line.size()));
    return word;
}

RequestHead head_of(std::string_view text) {
    RequestHead head;
    std::string_view first = take_line(text);
    head.method = take_word(first);
    head.target = take_word(first);
    head.is_upgrade = first == "upgrade";
    while (!text.empty()) {
        const std::string_view line = take_line(text);
        const std::size_t colon = line.find(": ");
        if (colon != std::string_view::npos) head.fields.emplace_back(line.substr(0, colon), line.substr(colon + 2));
    }
    return head;
}

const Rules& rules() {
    static const Rules made = [] {
        Rules those;
        those.authorities = allowed_authorities(8000, {"box:9"});
        those.token = "0123456789abcdef";
        those.cookie = "fedcba9876543210";
        those.cookie_name = "covol_mark_8000";
        those.live_path = "/live";
        those.max_body_bytes = 1000;
        return those;
    }();
    return made;
}

void check_request(const Request& request) {
    require(!request.path.empty() && request.path[0] == '/' && is_utf8(request.path));
    require(request.path.find('\0') == std::string::npos && request.path.find('\n') == std::string::npos);
    for (const auto& [name, value] : request.query) {
        require(is_utf8(name) && is_utf8(value) && (name + value).find('\0') == std::string::npos);
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const RequestHead head = head_of(text);
    const Decision judgement = judge(head, rules());
    switch (judgement.kind) {
        case Decision::Kind::Refuse:
            require(judgement.status >= 400 && judgement.status < 500 && !judgement.why.empty());
            break;
        case Decision::Kind::SetCookie: require(parse_target(head.target)->query.at("token") == rules().token); break;
        case Decision::Kind::Live:
            require(head.is_upgrade && text.find("http://") != std::string_view::npos);
            [[fallthrough]];
        case Decision::Kind::Post:
            require(judgement.kind != Decision::Kind::Post ||
                    (judgement.body_bytes >= 1 && judgement.body_bytes <= 1000 &&
                     text.find("http://") != std::string_view::npos));
            [[fallthrough]];
        case Decision::Kind::Get:
            require(text.find("covol_mark_8000=fedcba9876543210") != std::string_view::npos);
            check_request(judgement.request);
            break;
    }
    if (const auto request = parse_target(text)) check_request(*request);
    (void)is_authority(text);
    (void)has_cookie(text, rules().cookie_name, rules().cookie);
    require(is_header_value(attachment(text)));
    Response response;
    response.type = text;
    (void)why_unsendable(response);
    (void)headers_of(response, "page");
    return 0;
}
