// Tests, without sockets, of which requests are accepted, and of the headers of answers.
#include <catch2/catch.hpp>
#include <set>

#include "covol/error.h"
#include "serve/answers.h"
#include "serve/message_rate.h"
#include "serve/outbox.h"
#include "serve/request_rules.h"
#include "serve/secret.h"

namespace {

using namespace covol::serve;
using Kind = Decision::Kind;
using Fields = std::vector<std::pair<std::string_view, std::string_view>>;

const std::string kToken(64, 'a'), kCookie(64, 'b');
const std::string kCookieField = "theme=dark; covol_mark_8000=" + kCookie;

Rules rules() {
    Rules made;
    made.authorities = allowed_authorities(8000, {"Box.example:9000"});
    made.token = kToken;
    made.cookie = kCookie;
    made.cookie_name = "covol_mark_8000";
    made.live_path = "/live";
    return made;
}

/// The head of a request that is accepted. Tests change one part of it.
RequestHead good_head(std::string_view target = "/image") {
    return {"GET", target, {{"Host", "127.0.0.1:8000"}, {"Cookie", kCookieField}}, false};
}

RequestHead with(RequestHead head, std::string_view name, std::string_view value) {
    std::erase_if(head.fields, [&](const auto& field) { return field.first == name; });
    head.fields.emplace_back(name, value);
    return head;
}

RequestHead without(RequestHead head, std::string_view name) {
    std::erase_if(head.fields, [&](const auto& field) { return field.first == name; });
    return head;
}

RequestHead good_upgrade() {
    RequestHead head = with(good_head("/live"), "Origin", "http://127.0.0.1:8000");
    head.is_upgrade = true;
    return head;
}

int status_of(const RequestHead& head) {
    const Decision judgement = judge(head, rules());
    return judgement.kind == Kind::Refuse ? judgement.status : 0;
}

}  // namespace

TEST_CASE("Rules: requests as browsers send them are accepted") {
    CHECK(judge(good_head(), rules()).kind == Kind::Get);
    CHECK(judge(good_upgrade(), rules()).kind == Kind::Live);
    for (const std::string_view host : {"localhost:8000", "box.example:9000"}) {
        CHECK(status_of(with(good_head(), "Host", host)) == 0);
        const std::string origin = "http://" + std::string(host);
        CHECK(status_of(with(with(good_head(), "Host", host), "Origin", origin)) == 0);
    }
    for (const std::string_view site : {"same-origin", "none"}) {
        CHECK(status_of(with(good_head(), "Sec-Fetch-Site", site)) == 0);
    }
    CHECK(status_of(with(good_head(), "Content-Length", "0")) == 0);
    RequestHead head = good_head();
    head.method = "HEAD";
    CHECK(judge(head, rules()).is_head);
    for (auto& field : head.fields) {
        if (field.first == "Host") field.first = "hOST";
    }
    CHECK(status_of(head) == 0);
}

TEST_CASE("Rules: path and query are decoded for the handler") {
    const Decision judgement = judge(good_head("/sl%69ce?axis=1&name=K%C3%B6rper+2&empty=&sum=1=2"), rules());
    REQUIRE(judgement.kind == Kind::Get);
    CHECK(judgement.request.path == "/slice");
    CHECK(judgement.request.query ==
          std::map<std::string, std::string>{{"axis", "1"}, {"name", "K\u00f6rper 2"}, {"empty", ""}, {"sum", "1=2"}});
}

TEST_CASE("Rules: only the exact link with the token sets the cookie") {
    const std::string right = "/?token=" + kToken, wrong = "/?token=" + std::string(64, 'c');
    CHECK(judge(without(good_head(right), "Cookie"), rules()).kind == Kind::SetCookie);
    CHECK(judge(good_head(right), rules()).kind == Kind::SetCookie);
    for (const std::string& target :
         {wrong, right + "0", "/?token=" + kToken.substr(1), std::string("/?token="), "/image?token=" + kToken,
          "/?Token=" + kToken, "/?token=" + kCookie, std::string("/?token=%zz")}) {
        CAPTURE(target);
        CHECK(status_of(without(good_head(target), "Cookie")) == 403);
    }
    CHECK(status_of(good_head(wrong)) == 403);
    CHECK(status_of(good_head(right + "&more=1")) == 400);
}

TEST_CASE("Rules: requests without the exact cookie are rejected") {
    CHECK(status_of(without(good_head(), "Cookie")) == 403);
    CHECK(status_of(without(good_upgrade(), "Cookie")) == 403);
    for (const std::string& cookie :
         {std::string(), std::string("covol_mark_8000"), "covol_mark_8001=" + kCookie, "xcovol_mark_8000=" + kCookie,
          "covol_mark_8000=" + kToken, "covol_mark_8000=" + kCookie + "0", "covol_mark_8000=\"" + kCookie + "\"",
          "covol_mark_8000=" + kCookie.substr(1), "a=covol_mark_8000=" + kCookie}) {
        CAPTURE(cookie);
        CHECK(status_of(with(good_head(), "Cookie", cookie)) == 403);
        CHECK(status_of(with(good_upgrade(), "Cookie", cookie)) == 403);
    }
    // Without permission, a client does not learn whether the target exists.
    CHECK(status_of(without(good_head("/%00"), "Cookie")) == 403);
    CHECK(status_of(without(good_head("/live"), "Cookie")) == 403);
}

TEST_CASE("Rules: a second cookie of the same name does not hide the valid one") {
    CHECK(has_cookie("covol_mark_8000=other; covol_mark_8000=" + kCookie, "covol_mark_8000", kCookie));
    CHECK(has_cookie(";; covol_mark_8000=" + kCookie + " ;covol_mark_8000=", "covol_mark_8000", kCookie));
    CHECK_FALSE(has_cookie("", "covol_mark_8000", kCookie));
    RequestHead two = good_head();
    two.fields.emplace_back("Cookie", "covol_mark_8000=other");
    CHECK(status_of(two) == 0);
}

TEST_CASE("Rules: Host must be exactly one of the allowed names") {
    for (const std::string_view host :
         {"127.0.0.1", "127.0.0.1:80", "127.0.0.1:80000", "127.0.0.1:8000.evil.example", "evil.example:8000",
          "localhost:8000@evil.example", "localhost.:8000", "LOCALHOST:8000", "[::1]:8000", "", "box.example",
          "http://127.0.0.1:8000", "127.0.0.1:08000", "127.1:8000", "2130706433:8000"}) {
        CAPTURE(host);
        CHECK(status_of(with(good_head(), "Host", host)) == 403);
    }
    CHECK(status_of(without(good_head(), "Host")) == 400);
    RequestHead two = good_head();
    two.fields.emplace_back("Host", "127.0.0.1:8000");
    CHECK(status_of(two) == 400);
}

TEST_CASE("Rules: Origin must be the page's own, and is required for WebSockets") {
    for (const std::string_view origin :
         {"https://127.0.0.1:8000", "http://127.0.0.1:8001", "http://127.0.0.1", "http://evil.example", "null", "",
          "http://127.0.0.1:8000/", "http://127.0.0.1:8000.evil.example", "http://localhost:8000",
          "HTTP://127.0.0.1:8000", "127.0.0.1:8000"}) {
        CAPTURE(origin);
        CHECK(status_of(with(good_head(), "Origin", origin)) == 403);
        CHECK(status_of(with(good_upgrade(), "Origin", origin)) == 403);
    }
    CHECK(status_of(without(good_upgrade(), "Origin")) == 403);
    RequestHead two = good_upgrade();
    two.fields.emplace_back("origin", "http://127.0.0.1:8000");
    CHECK(status_of(two) == 403);
}

TEST_CASE("Rules: requests from other sites are rejected, except for navigation to the link with the token") {
    for (const std::string_view site : {"cross-site", "same-site", "", "None", "none, none"}) {
        CAPTURE(site);
        CHECK(status_of(with(good_head(), "Sec-Fetch-Site", site)) == 403);
        CHECK(status_of(with(good_upgrade(), "Sec-Fetch-Site", site)) == 403);
    }
    RequestHead two = with(good_head(), "Sec-Fetch-Site", "none");
    two.fields.emplace_back("sec-fetch-site", "none");
    CHECK(status_of(two) == 403);
    const std::string right = "/?token=" + kToken;
    CHECK(status_of(with(good_head(right), "Sec-Fetch-Site", "cross-site")) == 403);
    // An exception: the user follows a link on another page or in a file. It may replace the whole window, but not load
    // a part of a page, and only the address with the token may be opened in this way.
    const auto link = [&](std::string_view target, std::string_view mode, std::string_view to) {
        return with(with(with(good_head(target), "Sec-Fetch-Site", "cross-site"), "Sec-Fetch-Mode", mode),
                    "Sec-Fetch-Dest", to);
    };
    const Decision followed = judge(link(right, "navigate", "document"), rules());
    CHECK(followed.kind == Decision::Kind::SetCookie);
    CHECK(followed.is_link);
    CHECK_FALSE(judge(good_head(right), rules()).is_link);
    CHECK(status_of(link(right, "no-cors", "document")) == 403);
    CHECK(status_of(link(right, "navigate", "iframe")) == 403);
    CHECK(status_of(link("/image", "navigate", "document")) == 403);
}

TEST_CASE("Rules: frames are accepted only if allowed, from the same site, and for the link with the token") {
    Rules own = rules();
    const std::string target = "/?token=" + kToken;
    const auto framed = [&](std::string_view to, std::string_view site, std::string_view dest = "iframe") {
        const Decision judgement =
            judge(with(with(with(good_head(to), "Sec-Fetch-Site", site), "Sec-Fetch-Mode", "navigate"),
                       "Sec-Fetch-Dest", dest),
                  own);
        return judgement.kind == Kind::Refuse ? judgement.status : 0;
    };
    CHECK(framed(target, "same-site") == 403);
    own.may_be_framed = true;
    CHECK(framed(target, "same-site") == 0);
    CHECK(framed(target, "cross-site") == 403);
    CHECK(framed(target, "same-site", "embed") == 403);
    CHECK(framed("/", "same-site") == 403);
    CHECK(framed("/image", "same-site") == 403);
    Options options;
    options.frame_origins = {"http://localhost:8888", "http://127.0.0.1:8888"};
    CHECK(options.why_invalid().empty());
    for (const std::string bad :
         {"localhost:8888", "https://localhost:8888", "http://*", "http://a:1 b", "http://a/", ""}) {
        options.frame_origins = {bad};
        CAPTURE(bad);
        CHECK(options.why_invalid().find("frame_origins") == 0);
    }
}

TEST_CASE("Rules: only GET and HEAD without a body and with an address of at most 4096 bytes are accepted") {
    for (const std::string_view method : {"POST", "PUT", "DELETE", "OPTIONS", "TRACE", "CONNECT", "get", ""}) {
        RequestHead head = good_head();
        head.method = method;
        CAPTURE(method);
        CHECK(status_of(head) == 405);
    }
    CHECK(status_of(with(good_head(), "Content-Length", "1")) == 413);
    CHECK(status_of(with(good_head(), "Content-Length", "99999999999999999999999")) == 413);
    for (const std::string_view length : {"", "-1", "0x0", "0, 0", "0 "}) {
        CHECK(status_of(with(good_head(), "Content-Length", length)) == 400);
    }
    RequestHead two = with(good_head(), "Content-Length", "0");
    two.fields.emplace_back("content-length", "0");
    CHECK(status_of(two) == 400);
    CHECK(status_of(with(good_head(), "Transfer-Encoding", "chunked")) == 400);
    const std::string longest = "/" + std::string(4095, 'x');
    CHECK(status_of(good_head(longest)) == 0);
    CHECK(status_of(good_head(longest + "x")) == 414);
}

TEST_CASE("Rules: a POST is accepted only if uploads are enabled, from the page itself and within the limit") {
    const auto judged = [](const RequestHead& head, std::size_t maximum = 1000) {
        Rules own = rules();
        own.max_body_bytes = maximum;
        const Decision judgement = judge(head, own);
        return judgement.kind == Kind::Refuse ? judgement.status : judgement.kind == Kind::Post ? 0 : -1;
    };
    RequestHead good = with(with(good_head("/import"), "Origin", "http://127.0.0.1:8000"), "Content-Length", "1000");
    good.method = "POST";
    CHECK(judged(good) == 0);
    CHECK(judged(good, 0) == 405);
    CHECK(judged(good, 999) == 413);
    CHECK(judged(with(good, "Content-Length", "99999999999999999999999")) == 413);
    for (const std::string_view length : {"", "-1", "0x1", "1, 1", "1 ", "0"})
        CHECK(judged(with(good, "Content-Length", length)) == 400);
    CHECK(judged(without(good, "Content-Length")) == 411);
    RequestHead two = good;
    two.fields.emplace_back("content-length", "1000");
    CHECK(judged(two) == 411);
    CHECK(judged(with(good, "Transfer-Encoding", "chunked")) == 400);
    // Forms and scripts of other pages are refused; browsers state their origin.
    CHECK(judged(without(good, "Origin")) == 403);
    CHECK(judged(with(good, "Origin", "null")) == 403);
    CHECK(judged(with(good, "Origin", "http://127.0.0.1:8001")) == 403);
    CHECK(judged(with(good, "Sec-Fetch-Site", "same-site")) == 403);
    CHECK(judged(without(good, "Cookie")) == 403);
    CHECK(judged(with(good, "Host", "evil.example")) == 403);
    RequestHead other = good;
    for (const std::string_view target : {"/live", "/import#a"}) {
        other.target = target;
        CHECK(judged(other) >= 400);
    }
    const std::string link = "/?token=" + kToken;
    other = without(good, "Cookie");
    other.target = link;
    CHECK(judged(other) == 403);
    CHECK(judged(good_head()) == -1);
    CHECK(judge(good,
                [] {
                    Rules own = rules();
                    own.max_body_bytes = 1000;
                    return own;
                }())
              .body_bytes == 1000);
}

TEST_CASE("Rules: invalid addresses are rejected") {
    for (const std::string_view target : {"",           "image",      "*",           "http://127.0.0.1:8000/image",
                                          "/%",         "/%4",        "/%4g",        "/a%",
                                          "/%00",       "/a%0Ab",     "/a%7f",       "/%ff",
                                          "/%c0%af",    "/%ed%a0%80", "/a b",        "/a#b",
                                          "/?a",        "/?=1",       "/?a=1&",      "/?&a=1",
                                          "/?a=1&&b=2", "/?a=1&a=2",  "/?a=1&%61=2", "/?a=%00",
                                          "/?a=%",      "/?a=%e4",    "/?%zz=1",     "/?a=b\xc3\xa4",
                                          "/\xff",      "/?a=\x01"}) {
        CAPTURE(target);
        CHECK_FALSE(parse_target(target).has_value());
        CHECK(status_of(good_head(target)) == 400);
    }
    CHECK(parse_target("/?").has_value());
    CHECK(parse_target("/a%2Fb?c=%0A")->path == "/a/b");
    CHECK(parse_target("/?a=?&b=/")->query.at("a") == "?");
}

TEST_CASE("Rules: WebSockets are opened at one address only") {
    RequestHead head = good_upgrade();
    head.target = "/image";
    CHECK(status_of(head) == 404);
    CHECK(status_of(good_head("/live")) == 426);
    CHECK(judge(good_upgrade(), rules()).request.path == "/live");
}

TEST_CASE("Rules: authorities are a valid name with an optional port") {
    for (const std::string_view good :
         {"localhost", "a.b:1", "127.0.0.1:65535", "[::1]:80", "[fe80::1]", "my_box:22"}) {
        CAPTURE(good);
        CHECK(is_authority(good));
    }
    for (const std::string_view bad : {"", ":80", "a:", "a:0", "a:65536", "a:8x", "a b", "a:1:2", "http://a", "a/b",
                                       "*", "[]:1", "[::1", "[x]:1", "[::1]1", "a:-1", "a:+1", "a:4294967297", "a@b"}) {
        CAPTURE(bad);
        CHECK_FALSE(is_authority(bad));
    }
    CHECK(allowed_authorities(80, {"A:80"}) == std::vector<std::string>{"127.0.0.1", "localhost", "a"});
}

TEST_CASE("is_utf8: overlong forms, surrogates and truncated sequences are rejected") {
    for (const std::string_view good : {"", "a", "\u00e9", "\uffff", "\U0010ffff", "\ud7ff"}) CHECK(is_utf8(good));
    for (const std::string_view bad : {"\x80", "\xc3", "\xc1\xbf", "\xe0\x9f\xbf", "\xed\xa0\x80", "\xf0\x8f\xbf\xbf",
                                       "\xf4\x90\x80\x80", "\xf8\x88\x80\x80\x80", "\xe2\x82", "\xe2\x82x", "\xff"}) {
        CHECK_FALSE(is_utf8(bad));
    }
}

TEST_CASE("Secrets are 64 random hexadecimal digits and are compared exactly") {
    std::set<std::string> all;
    for (int n = 0; n < 100; ++n) {
        const std::string secret = random_secret();
        CHECK(secret.size() == 64);
        CHECK(secret.find_first_not_of("0123456789abcdef") == std::string::npos);
        all.insert(secret);
    }
    CHECK(all.size() == 100);
    CHECK(is_same_secret(kToken, std::string(64, 'a')));
    CHECK_FALSE(is_same_secret(kToken, std::string(63, 'a')));
    for (std::size_t n = 0; n < 64; ++n) {
        std::string guess = kToken;
        guess[n] = 'A';
        CHECK_FALSE(is_same_secret(kToken, guess));
    }
}

TEST_CASE("attachment: file names are escaped in the header") {
    CHECK(attachment("mesh.ply") == "attachment; filename=\"mesh.ply\"; filename*=UTF-8''mesh.ply");
    CHECK(attachment("K\u00f6rper 1.ply") ==
          "attachment; filename=\"K__rper 1.ply\"; filename*=UTF-8''K%C3%B6rper%201.ply");
    CHECK(attachment("../a\\b") == "attachment; filename=\"_._a_b\"; filename*=UTF-8''_._a_b");
    CHECK(attachment("a\"b;\r\nX: y'%*") ==
          "attachment; filename=\"a_b___X_ y___\"; filename*=UTF-8''a%22b%3B__X%3A%20y%27%25%2A");
}

TEST_CASE("why_unsendable: responses with an invalid status, type or header are rejected") {
    CHECK(why_unsendable({}).empty());
    Response response;
    for (const int status : {0, 101, 199, 600, -1}) {
        response.status = status;
        CHECK_FALSE(why_unsendable(response).empty());
    }
    response.status = 200;
    for (const std::string type : {"", "text/html\r\nX: y", "a\n"}) {
        response.type = type;
        CHECK_FALSE(why_unsendable(response).empty());
    }
    response.type = "text/html";
    for (const auto& [name, value] : Headers{{"X-Width", "1\r\nY: 2"},
                                             {"X Width", "1"},
                                             {"", "1"},
                                             {"X:", "1"},
                                             {"Content-Security-Policy", "x"},
                                             {"content-LENGTH", "1"},
                                             {"Transfer-Encoding", "chunked"},
                                             {"Set-Cookie", "a=b"},
                                             {"X", std::string("\0", 1)}}) {
        response.headers = {{name, value}};
        CAPTURE(name);
        CHECK_FALSE(why_unsendable(response).empty());
    }
    response.headers = {{"X-Width", "12"}};
    CHECK(why_unsendable(response).empty());
}

TEST_CASE("Content-Security-Policy: only HTML responses get the policy of the page") {
    const auto policy = [](const std::string& type) {
        Response response;
        response.type = type;
        for (const auto& [name, value] : headers_of(response, "page")) {
            if (name == "Content-Security-Policy") return value;
        }
        return std::string();
    };
    for (const std::string type : {"text/html", "TEXT/HTML; charset=utf-8", "text/html;a=b"})
        CHECK(policy(type) == "page");
    for (const std::string type : {"text/plain", "application/json", "text/htmlx", "image/svg+xml"}) {
        CHECK(policy(type) == "default-src 'none'");
    }
}

TEST_CASE("MessageRate: a burst is allowed, then the rate, and no more than the burst accumulates") {
    using std::chrono::milliseconds;
    MessageRate rate(10, 5);
    MessageRate::Time now = std::chrono::steady_clock::now();
    for (int n = 0; n < 5; ++n) CHECK(rate.allows_one(now));
    CHECK_FALSE(rate.allows_one(now));
    CHECK_FALSE(rate.allows_one(now + milliseconds(50)));
    CHECK(rate.allows_one(now + milliseconds(101)));
    CHECK_FALSE(rate.allows_one(now + milliseconds(102)));
    now += std::chrono::hours(1);  // no more than the burst accumulates
    for (int n = 0; n < 5; ++n) CHECK(rate.allows_one(now));
    CHECK_FALSE(rate.allows_one(now));
}

TEST_CASE("Outbox: messages wait in order, up to a limit in bytes") {
    const auto text = [](std::size_t size) { return std::make_shared<const std::string>(size, 'x'); };
    Outbox box(100);
    CHECK(box.add(text(1), true) == Outbox::Added::Refused);  // not before the greeting
    const SharedText first = text(150), second = text(10);
    CHECK(box.add(first, false) == Outbox::Added::First);  // a single text may exceed the limit
    CHECK(box.next() == first);
    CHECK_FALSE(box.written());
    CHECK(box.add(first, true) == Outbox::Added::First);
    CHECK(box.written() == false);
    CHECK(box.add(text(60), true) == Outbox::Added::First);
    CHECK(box.add(second, true) == Outbox::Added::Waiting);
    CHECK(box.add(text(30), false) == Outbox::Added::Waiting);
    CHECK(box.written());
    CHECK(box.next() == second);
    CHECK(box.add(text(60), false) == Outbox::Added::Waiting);
    CHECK(box.add(text(1), false) == Outbox::Added::TooMuch);
    CHECK(box.add(text(0), false) == Outbox::Added::Refused);
    Outbox silent(100);
    silent.take_broadcasts();
    CHECK(silent.add(text(1), true) == Outbox::Added::First);
}

TEST_CASE("Server options: an invalid option is reported by name") {
    CHECK(Options().why_invalid().empty());
    const auto starts = [](const Options& options, const std::string& name) {
        return options.why_invalid().starts_with(name + ": ");
    };
    Options options;
    options.authorities = {"a:1", "http://b"};
    CHECK(starts(options, "authorities"));
    options = {};
    options.page_policy = "a\nb";
    CHECK(starts(options, "page_policy"));
    options = {};
    options.live_path = "live";
    CHECK(starts(options, "live_path"));
    options = {};
    options.get_threads = 0;
    CHECK(starts(options, "get_threads"));
    options = {};
    options.message_burst = 0.5;
    CHECK(starts(options, "message_burst"));
    CHECK_THROWS_AS(WebServer(options, {}), covol::Error);
}
