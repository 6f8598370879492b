// Tests of a running server: which requests it answers, and how.
#include <fcntl.h>
#include <sys/stat.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <condition_variable>
#include <thread>

#include "covol/error.h"
#include "unit/serve/serve_client.h"

namespace {

using namespace serve_test;
using covol::serve::Handlers;
using covol::serve::Options;
using covol::serve::Request;
using covol::serve::Response;
using covol::serve::WebServer;
using Clock = std::chrono::steady_clock;

Response page(const Request& request) {
    Response response;
    response.type = request.path == "/" ? "text/html; charset=utf-8" : "text/plain; charset=utf-8";
    response.body = request.path;
    for (const auto& [name, value] : request.query) response.body += " " + name + "=" + value;
    return response;
}

Handlers pages() {
    Handlers handlers;
    handlers.get = page;
    return handlers;
}

/// Lets handlers wait until open() is called.
class Gate {
public:
    ~Gate() { open(); }
    void wait() {
        std::unique_lock lock(mutex_);
        ++waiting_;
        changed_.wait(lock, [&] { return is_open_; });
    }
    void open() {
        const std::lock_guard lock(mutex_);
        is_open_ = true;
        changed_.notify_all();
    }
    [[nodiscard]] int waiting() {
        const std::lock_guard lock(mutex_);
        return waiting_;
    }

private:
    std::mutex mutex_;
    std::condition_variable changed_;
    int waiting_ = 0;
    bool is_open_ = false;
};

void check_protection(const http::fields& answer, const std::string& policy = "default-src 'none'") {
    CHECK(answer["X-Content-Type-Options"] == "nosniff");
    CHECK(answer["X-Frame-Options"] == "DENY");
    CHECK(answer["Cross-Origin-Resource-Policy"] == "same-origin");
    CHECK(answer["Cross-Origin-Opener-Policy"] == "same-origin");
    CHECK(answer["Referrer-Policy"] == "no-referrer");
    CHECK(answer["Cache-Control"] == "no-store");
    CHECK(answer["Content-Security-Policy"] == policy);
    CHECK(answer.count("Access-Control-Allow-Origin") == 0);
}

}  // namespace

TEST_CASE("Server: the link sets the cookie and redirects to the page") {
    Options options;
    options.page_policy = "default-src 'none'; script-src 'sha256-x'";
    const Site site(pages(), options);
    CHECK(site.server.url() == "http://127.0.0.1:" + std::to_string(site.port) + "/?token=" + site.token);
    CHECK(site.token.size() == 64);
    const Answer first = site.get("/?token=" + site.token, {{"Cookie", "-"}});
    CHECK(first.result_int() == 303);
    CHECK(first["Location"] == "/");
    CHECK(first["Set-Cookie"] == site.cookie + "; HttpOnly; SameSite=Strict; Path=/");
    CHECK(site.cookie.starts_with("covol_mark_" + std::to_string(site.port) + "="));
    CHECK(site.cookie.find(site.token) == std::string::npos);
    check_protection(first);
    const Answer second = site.get("/");
    CHECK(second.result_int() == 200);
    CHECK(second.body() == "/");
    check_protection(second, options.page_policy + "; frame-ancestors 'none'");
    check_protection(site.get("/image"));
    CHECK(site.get("/a?b=%20c&d=e").body() == "/a b= c d=e");
}

TEST_CASE("Server: a rejected request gets its status, reaches no handler, and its connection is closed") {
    std::atomic<int> calls{0};
    Handlers handlers;
    handlers.get = [&](const Request& request) { return ++calls, page(request); };
    const Site site(handlers);
    struct Case {
        const char* what;
        int status;
        std::string text;
    };
    Fields no_origin = site.upgrade(), wrong_origin = site.upgrade(), no_cookie = site.upgrade();
    no_origin[0].second = "-";
    wrong_origin[0].second = "http://evil.example";
    no_cookie.emplace_back("Cookie", "-");
    const std::vector<Case> cases{
        {"no cookie", 403, site.head("/image", {{"Cookie", "-"}})},
        {"cookie of another run", 403, site.head("/image", {{"Cookie", site.cookie.substr(0, 20)}})},
        {"wrong token", 403, site.head("/?token=" + std::string(64, '0'))},
        {"other host", 403, site.head("/image", {{"Host", "evil.example"}})},
        {"host with a prefix", 403, site.head("/image", {{"Host", "x" + site.host}})},
        {"no host", 400, site.head("/image", {{"Host", "-"}})},
        {"other origin", 403, site.head("/image", {{"Origin", "http://evil.example"}})},
        {"other site", 403, site.head("/image", {{"Sec-Fetch-Site", "cross-site"}})},
        {"same site, other port", 403, site.head("/image", {{"Sec-Fetch-Site", "same-site"}})},
        {"WebSocket without origin", 403, site.head("/live", no_origin)},
        {"WebSocket of another page", 403, site.head("/live", wrong_origin)},
        {"WebSocket without cookie", 403, site.head("/live", no_cookie)},
        {"WebSocket elsewhere", 404, site.head("/image", site.upgrade())},
        {"no WebSocket", 426, site.head("/live")},
        {"method", 405, site.head("/image", {}, "POST")},
        {"method of one's own", 405, site.head("/image", {}, "BREW")},
        {"preflight", 405, site.head("/image", {{"Origin", "http://evil.example"}}, "OPTIONS")},
        {"body", 413, site.head("/image", {{"Content-Length", "5"}}) + "hello"},
        {"large body", 413, site.head("/image", {{"Content-Length", "999999999"}}) + std::string(200'000, 'x')},
        {"chunks", 400, site.head("/image", {{"Transfer-Encoding", "chunked"}}) + "0\r\n\r\n"},
        {"bad length", 400, site.head("/image", {{"Content-Length", "x"}})},
        {"long address", 414, site.head("/" + std::string(5000, 'a'))},
        {"large head", 431, site.head("/image", {{"X-More", std::string(17'000, 'a')}})},
        {"large head without an end", 431, "GET /" + std::string(20'000, 'a')},
        {"bad escape", 400, site.head("/a?b=%zz")},
        {"NUL", 400, site.head("/a?b=%00")},
        {"name twice", 400, site.head("/a?b=1&b=2")},
        {"whole address", 400, site.head("http://" + site.host + "/image")},
        {"no HTTP", 400, "hello\r\n\r\n"},
        {"TLS", 400, std::string("\x16\x03\x01\x02\x00\x01\x00", 7)},
        {"bad field", 400, "GET / HTTP/1.1\r\nHo st: a\r\n\r\n"},
    };
    for (const Case& one : cases) {
        CAPTURE(one.what);
        HttpConnection connection(site.port);
        connection.send(one.text);
        const Answer answer = connection.receive();
        CHECK(int(answer.result_int()) == one.status);
        CHECK(answer["Content-Type"] == "text/plain; charset=utf-8");
        CHECK(answer.count("Set-Cookie") == 0);
        CHECK_FALSE(answer.keep_alive());
        check_protection(answer);
        CHECK(connection.is_at_end());
    }
    CHECK(calls == 0);
    CHECK(site.get("/image", {}, "DELETE")["Allow"] == "GET, HEAD");
}

TEST_CASE("Server: further authorities are accepted, and invalid ones are rejected") {
    Options options;
    options.authorities = {"localhost:9999"};
    const Site site(pages(), options);
    CHECK(site.get("/a", {{"Host", "localhost:9999"}, {"Origin", "http://localhost:9999"}}).result_int() == 200);
    CHECK(site.get("/a", {{"Host", "localhost:9998"}}).result_int() == 403);
    CHECK(site.get("/a", {{"Host", "localhost:" + std::to_string(site.port)}}).result_int() == 200);
    options.authorities = {"http://localhost"};
    CHECK_THROWS_WITH(WebServer(options, {}), Catch::Contains("authorities: expected name:port"));
}

TEST_CASE("Server: a connection serves many requests, also if they are pipelined") {
    const Site site(pages());
    HttpConnection connection(site.port);
    for (int n = 0; n < 3; ++n) {
        connection.send(site.head("/" + std::to_string(n)));
        CHECK(connection.receive().body() == "/" + std::to_string(n));
    }
    connection.send(site.head("/3") + site.head("/4") + site.head("/5", {}, "HEAD") + site.head("/6"));
    CHECK(connection.receive().body() == "/3");
    CHECK(connection.receive().body() == "/4");
    CHECK(connection.receive(true)["Content-Length"] == "2");
    CHECK(connection.receive().body() == "/6");
    connection.send(site.head("/7", {{"Connection", "close"}}));
    CHECK(connection.receive().body() == "/7");
    CHECK(connection.is_at_end());
    HttpConnection old(site.port);
    old.send("GET /8 HTTP/1.0\r\nHost: " + site.host + "\r\nCookie: " + site.cookie + "\r\n\r\n");
    CHECK(old.receive().body() == "/8");
    CHECK(old.is_at_end());
}

TEST_CASE("Server: HEAD returns the header fields of GET without the body") {
    const Site site(pages());
    const Answer whole = site.get("/abc"), head = site.get("/abc", {}, "HEAD");
    CHECK(head.result_int() == 200);
    CHECK(head["Content-Length"] == "4");
    CHECK(head.body().empty());
    for (const auto& field : whole) CHECK(head[field.name_string()] == field.value());
}

TEST_CASE("Server: deflated bodies, large bodies and files are sent with their header fields") {
    std::string large(30 << 20, 'x');
    for (std::size_t n = 0; n < large.size(); n += 1000) large[n] = char('a' + n / 1000 % 26);
    Handlers handlers;
    handlers.get = [&](const Request& request) {
        Response response;
        response.type = "application/octet-stream";
        response.is_deflated = request.path == "/deflated";
        response.body = request.path == "/large" ? large : std::string("\x78\x9c\0\r\n\xff", 6);
        response.headers = {{"X-Width", "12"}};
        if (request.path == "/file") response.file_name = "K\u00f6rper.ply";
        if (request.path == "/none") response.status = 204;
        return response;
    };
    const Site site(handlers);
    const Answer deflated = site.get("/deflated");
    CHECK(deflated["Content-Encoding"] == "deflate");
    CHECK(deflated["X-Width"] == "12");
    CHECK(deflated.body() == std::string("\x78\x9c\0\r\n\xff", 6));
    CHECK(site.get("/large").body() == large);
    CHECK(site.get("/large").count("Content-Encoding") == 0);
    CHECK(site.get("/file")["Content-Disposition"] ==
          "attachment; filename=\"K__rper.ply\"; filename*=UTF-8''K%C3%B6rper.ply");
    HttpConnection connection(site.port);
    connection.send(site.head("/none") + site.head("/deflated"));
    CHECK(connection.receive().result_int() == 204);
    CHECK(connection.receive().body().size() == 6);
}

TEST_CASE("Server: POST bodies arrive complete, one at a time, and the connection stays open") {
    CallRecorder log;
    std::atomic<bool> may_answer{true};
    Handlers handlers;
    handlers.post = [&](const Request& request, std::string body) {
        log.add(request.path + " " + std::to_string(body.size()));
        while (!may_answer) std::this_thread::sleep_for(std::chrono::milliseconds(5));
        Response response;
        response.body = body.substr(body.size() - 3);
        return response;
    };
    Options options;
    options.max_body_bytes = 3'000'000;
    Site site(handlers, options);
    const auto head = [&](std::size_t bytes) {
        return site.head("/import?as=points",
                         {{"Origin", "http://" + site.host}, {"Content-Length", std::to_string(bytes)}}, "POST");
    };
    const std::string body = std::string(2'999'997, 'x') + "end";
    {
        HttpConnection connection(site.port);
        for (int n = 0; n < 2; ++n) {
            connection.send(head(body.size()) + body);
            const Answer answer = connection.receive();
            CHECK(answer.result_int() == 200);
            CHECK(answer.body() == "end");
        }
        connection.send(site.head("/image"));
        CHECK(connection.receive().result_int() == 404);
        connection.send(head(body.size() + 1));
        CHECK(connection.receive().result_int() == 413);
        CHECK(connection.is_at_end());
    }
    may_answer = false;
    HttpConnection first(site.port), second(site.port);
    first.send(head(4) + "1234");
    REQUIRE(becomes_true([&] { return log.count("/import 4") == 1; }));
    second.send(head(4) + "5678");
    CHECK(second.receive().result_int() == 503);
    may_answer = true;
    CHECK(first.receive().body() == "234");
    // A client that disconnects halfway through a POST does not block the next one.
    {
        HttpConnection cut(site.port);
        cut.send(head(1000) + "half");
    }
    CHECK(becomes_true([&] {
        HttpConnection next(site.port);
        next.send(head(4) + "9abc");
        return next.receive().result_int() == 200;
    }));
    CHECK(log.count("/import") == 4);
}

TEST_CASE("Server: errors in a handler are logged, and the client gets a generic error 500") {
    CallRecorder log;
    Handlers handlers;
    handlers.get = [](const Request& request) -> Response {
        if (request.path == "/number") throw 7;
        if (request.path == "/header") return {200, "text/plain", "", false, {{"X-A", "1\r\nSet-Cookie: a=b"}}, ""};
        throw std::runtime_error("secret detail");
    };
    handlers.on_error = [&](const std::string& text) {
        log.add(text);
        throw std::runtime_error("the log fails, too");
    };
    const Site site(handlers);
    for (const char* target : {"/exception", "/number", "/header"}) {
        const Answer answer = site.get(target);
        CHECK(answer.result_int() == 500);
        CHECK(answer.body() == "The request failed because of an internal error.\n");
        check_protection(answer);
    }
    CHECK(log.count("/exception: secret detail") == 1);
    CHECK(log.count("/number: ") == 1);
    CHECK(log.count("/header: X-A: ") == 1);
    const Site silent({});
    CHECK(silent.get("/").result_int() == 404);
}

TEST_CASE("Server: at the connection limit an idle connection is closed, and without one the status is 503") {
    Gate gate;
    Handlers handlers;
    handlers.get = [&](const Request& request) {
        if (request.path == "/slow") gate.wait();
        return page(request);
    };
    Options options;
    options.max_connections = 4;
    const Site site(handlers, options);
    std::vector<std::unique_ptr<HttpConnection>> connections;
    for (int n = 0; n < 4; ++n) {
        connections.push_back(std::make_unique<HttpConnection>(site.port));
        connections.back()->send(site.head("/" + std::to_string(n)));
        CHECK(connections.back()->receive().result_int() == 200);
    }
    CHECK(site.get("/more").result_int() == 200);
    CHECK(connections[0]->is_at_end());
    connections.erase(connections.begin());
    for (auto& connection : connections) connection->send(site.head("/slow"));
    connections.push_back(std::make_unique<HttpConnection>(site.port));
    connections.back()->send(site.head("/slow"));
    REQUIRE(becomes_true([&] { return gate.waiting() == 4; }));
    CHECK(site.get("/more").result_int() == 503);
    gate.open();
    for (auto& connection : connections) CHECK(connection->receive().body() == "/slow");
    CHECK(becomes_true([&] { return site.get("/more").result_int() == 200; }));
}

TEST_CASE("Server: connections without a complete request are closed after the idle time") {
    Options options;
    options.idle = std::chrono::milliseconds(200);
    const Site site(pages(), options);
    HttpConnection silent(site.port), half(site.port), kept(site.port);
    half.send("GET / HTTP/1.1\r\nHost: ");
    kept.send(site.head("/"));
    CHECK(kept.receive().result_int() == 200);
    CHECK(silent.is_at_end());
    CHECK(half.is_at_end());
    CHECK(kept.is_at_end());
}

TEST_CASE("Server: a handler is notified if its client has disconnected") {
    std::atomic<int> left{0}, stayed{0};
    Gate gate;
    Handlers handlers;
    handlers.get = [&](const Request& request) {
        gate.wait();
        if (request.path == "/left") left = becomes_true([&] { return request.gone->load(); }) ? 1 : -1;
        if (request.path == "/stayed") stayed = *request.gone ? -1 : 1;
        return page(request);
    };
    const Site site(handlers, {});
    HttpConnection patient(site.port);
    patient.send(site.head("/stayed") + site.head("/stayed"));  // the second one is queued
    {
        HttpConnection hasty(site.port);
        hasty.send(site.head("/left"));
        REQUIRE(becomes_true([&] { return gate.waiting() == 2; }));
    }
    gate.open();
    for (int n = 0; n < 2; ++n) CHECK(patient.receive().body() == "/stayed");
    CHECK(becomes_true([&] { return left == 1; }));
    CHECK(stayed == 1);
}

TEST_CASE("Server: cookies and tokens of another server are rejected") {
    const Site one(pages()), two(pages());
    CHECK(one.port != two.port);
    CHECK(one.token != two.token);
    CHECK(one.get("/", {{"Cookie", one.cookie + "; " + two.cookie}}).result_int() == 200);
    CHECK(two.get("/", {{"Cookie", one.cookie}}).result_int() == 403);
    const std::string of_one = one.cookie.substr(one.cookie.find('='));
    CHECK(two.get("/", {{"Cookie", two.cookie.substr(0, two.cookie.find('=')) + of_one}}).result_int() == 403);
    CHECK(two.get("/?token=" + one.token).result_int() == 403);
}

TEST_CASE("Server: a port in use is an error with its number, and is free after the server has stopped") {
    auto first = std::make_unique<WebServer>(Options(), pages());
    Options options;
    options.port = first->port();
    try {
        const WebServer second(options, pages());
        FAIL("two servers on one port");
    } catch (const covol::Error& error) {
        CHECK(error.code() == covol::Errc::Io);
        CHECK(error.option() == "port");
        CHECK_THAT(error.what(), Catch::Contains("port " + std::to_string(options.port) + " of 127.0.0.1: another"));
    }
    HttpConnection connection(options.port);
    first.reset();
    CHECK(connection.is_at_end());
    const WebServer third(options, pages());
    CHECK(third.port() == options.port);
}

TEST_CASE("Server: it listens on 127.0.0.1 alone, and its sockets are close-on-exec") {
    const Site site(pages());
    asio::io_context io;
    asio::ip::tcp::socket other(io);
    for (const char* address : {"127.0.0.2", "::1"}) {
        beast::error_code status;
        other.connect({asio::ip::make_address(address), site.port}, status);
        CAPTURE(address);
        CHECK(status);
        other.close(status);
    }
    HttpConnection connection(site.port);
    connection.send(site.head("/"));
    CHECK(connection.receive().result_int() == 200);
    int found = 0;
    for (int fd = 3; fd < 256; ++fd) {
        sockaddr_in local{};
        socklen_t size = sizeof local;
        if (::getsockname(fd, reinterpret_cast<sockaddr*>(&local), &size) != 0 || local.sin_family != AF_INET) continue;
        if (ntohs(local.sin_port) != site.port) continue;
        ++found;
        CHECK((::fcntl(fd, F_GETFD) & FD_CLOEXEC) != 0);
        CHECK(local.sin_addr.s_addr == htonl(INADDR_LOOPBACK));
    }
    CHECK(found >= 2);
}

TEST_CASE("Server: stopping waits for a running handler and drops queued requests") {
    Gate gate;
    std::atomic<int> calls{0};
    Handlers handlers;
    handlers.get = [&](const Request& request) {
        ++calls;
        gate.wait();
        return page(request);
    };
    Options options;
    options.get_threads = 1;
    Site site(handlers, options);
    HttpConnection one(site.port), two(site.port), idle(site.port);
    one.send(site.head("/1"));
    REQUIRE(becomes_true([&] { return gate.waiting() == 1; }));
    two.send(site.head("/2"));
    std::thread opener([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(300));
        gate.open();
    });
    const auto start = Clock::now();
    site.server.stop();
    CHECK(Clock::now() - start < std::chrono::seconds(1));
    CHECK(calls == 1);
    CHECK(one.is_at_end());
    CHECK(two.is_at_end());
    CHECK(idle.is_at_end());
    site.server.stop();
    opener.join();
    CHECK_THROWS(HttpConnection(site.port));
}
