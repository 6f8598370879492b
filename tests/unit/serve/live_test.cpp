// Tests of the WebSockets of a running server.
#include <catch2/catch.hpp>
#include <future>
#include <thread>

#include "unit/serve/serve_client.h"

namespace {

using namespace serve_test;
using covol::serve::Client;
using covol::serve::Handlers;
using covol::serve::Options;
using covol::serve::Request;
using covol::serve::Response;
using Clock = std::chrono::steady_clock;

/// A server that greets its clients and echoes their messages.
class Echo {
public:
    explicit Echo(Options options = {}, const Handlers& other = {}) : site_(handlers(other), std::move(options)) {}
    Site& site() { return site_; }
    CallRecorder& log() { return log_; }
    [[nodiscard]] Client last() const { return {last_}; }

private:
    Handlers handlers(const Handlers& other) {
        Handlers made = other;
        made.opened = [this](Client client) {
            last_ = client.number;
            log_.add("opened " + std::to_string(client.number));
            site_.server.send(client, "hello");
        };
        made.closed = [this](Client client) { log_.add("closed " + std::to_string(client.number)); };
        made.on_error = [this](const std::string& text) { log_.add("error " + text); };
        if (!made.message) {
            made.message = [this](Client client, std::string_view text) {
                site_.server.send(client, std::string(text));
            };
        }
        return made;
    }

    CallRecorder log_;
    std::atomic<std::uint64_t> last_{0};
    Site site_;
};

}  // namespace

TEST_CASE("WebSocket: a client is greeted and receives the echo of its messages") {
    Echo echo;
    {
        Live live(echo.site());
        CHECK(live.answer["X-Content-Type-Options"] == "nosniff");
        CHECK(live.answer["Cache-Control"] == "no-store");
        CHECK(live.receive() == "hello");
        for (const std::string& text :
             {std::string(), std::string("{\"do\":1}"), std::string("K\u00f6rper"), std::string(1'000'000, 'x')}) {
            live.send(text);
            CHECK(live.receive() == text);
        }
        CHECK(echo.log().lines() == std::vector<std::string>{"opened 1"});
        live.close();
    }
    CHECK(becomes_true([&] { return echo.log().count("closed 1") == 1; }));
    CHECK_FALSE(echo.site().server.send(Client{1}, "late"));
    CHECK_FALSE(echo.site().server.send(Client{77}, "nobody"));
    Live second(echo.site());
    CHECK(second.receive() == "hello");
    CHECK(echo.last() == Client{2});
}

TEST_CASE("WebSocket: messages keep their order in both directions") {
    CallRecorder log;
    Handlers handlers;
    handlers.message = [&](Client, std::string_view text) { log.add(std::string(text)); };
    Echo echo({}, handlers);
    Live live(echo.site());
    CHECK(live.receive() == "hello");
    for (int n = 0; n < 2000; ++n) CHECK(echo.site().server.send(echo.last(), std::to_string(n)));
    for (int n = 0; n < 2000; ++n) CHECK(live.receive() == std::to_string(n));
    for (int n = 0; n < 300; ++n) live.send(std::to_string(n));
    REQUIRE(becomes_true([&] { return log.lines().size() == 300; }));
    for (std::size_t n = 0; n < 300; ++n) CHECK(log.lines()[n] == std::to_string(n));
}

TEST_CASE("WebSocket: broadcasts reach all clients in the same order") {
    Echo echo;
    Live one(echo.site()), two(echo.site());
    CHECK(one.receive() == "hello");
    CHECK(two.receive() == "hello");
    std::vector<std::thread> threads;
    for (int k = 0; k < 4; ++k) {
        threads.emplace_back([&, k] {
            for (int n = 0; n < 100; ++n) echo.site().server.broadcast(std::to_string(k) + "/" + std::to_string(n));
        });
    }
    for (auto& thread : threads) thread.join();
    for (int n = 0; n < 400; ++n) CHECK(one.receive() == two.receive());
}

TEST_CASE("WebSocket: messages that the opened handler sends arrive before any broadcast") {
    std::promise<void> release;
    std::shared_future<void> released(release.get_future());
    std::atomic<bool> is_inside{false};
    Site* site = nullptr;
    Handlers handlers;
    handlers.opened = [&](Client client) {
        is_inside = true;
        released.wait();
        site->server.send(client, "state");
        site->server.broadcast("after");
    };
    Site made(handlers);
    site = &made;
    Live live(made);
    REQUIRE(becomes_true([&] { return is_inside.load(); }));
    made.server.broadcast("before");
    release.set_value();
    CHECK(live.receive() == "state");
    CHECK(live.receive() == "after");
}

TEST_CASE("WebSocket: messages that are too large, too frequent or not text close the client") {
    Options options;
    options.max_message_bytes = 1000;
    options.messages_per_second = 10;
    options.message_burst = 50;
    Echo echo(options);
    {
        Live live(echo.site());
        live.send(std::string(1000, 'x'));
        live.send(std::string(1001, 'x'));
        CHECK(live.closed_with() == 1009);
    }
    {
        Live live(echo.site());
        live.socket().binary(true);
        live.send("x");
        CHECK(live.closed_with() == 1003);
    }
    {
        Live live(echo.site());
        live.send("\xff\xfe");
        CHECK(live.closed_with() == 1007);
    }
    {
        Live live(echo.site());
        for (int n = 0; n < 60; ++n) live.send("x");
        CHECK(live.closed_with() == 1008);
    }
    {
        Live live(echo.site());
        for (int n = 0; n < 60; ++n) live.socket().ping({});
        CHECK(live.closed_with() == 1008);
    }
    CHECK(becomes_true([&] { return echo.log().count("closed ") == 5; }));
    CHECK(echo.log().count("error") == 0);
}

TEST_CASE("WebSocket: the close reason arrives also while the server is sending messages") {
    Options options;
    options.max_message_bytes = 1000;
    Echo echo(options);
    Live live(echo.site());
    CHECK(live.receive() == "hello");
    std::jthread writer([&] {
        for (int n = 0; n < 50; ++n) {  // some texts before the server has sent its reason for closing, and some after
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
            (void)echo.site().server.send(echo.last(), "x");
        }
    });
    live.send(std::string(20'000'000, 'x'));
    CHECK(live.closed_with() == 1009);
    writer.join();
    CHECK(becomes_true([&] { return echo.log().count("closed 1") == 1; }));
}

TEST_CASE("WebSocket: a client can close while the server is sending messages") {
    Echo echo;
    for (int n = 0; n < 20; ++n) {
        Live live(echo.site());
        CHECK(live.receive() == "hello");
        std::jthread writer([&] {
            for (int k = 0; k < 2000; ++k) (void)echo.site().server.send(echo.last(), "x");
        });
        CHECK(live.receive() == "x");
        CHECK_NOTHROW(live.close());
        writer.join();
    }
}

TEST_CASE("WebSocket: a client that floods the server with messages is disconnected") {
    Options options;
    options.message_burst = 50;
    Echo echo(options);
    Live live(echo.site());
    beast::error_code status;
    const auto start = Clock::now();
    while (!status && Clock::now() - start < std::chrono::seconds(8)) {
        live.socket().write(asio::buffer("x", 1), status);
    }
    CHECK(status);
    CHECK(becomes_true([&] { return echo.log().count("closed 1") == 1; }));
}

TEST_CASE("WebSocket: all messages of an allowed burst are answered") {
    Echo echo;
    Live live(echo.site());
    CHECK(live.receive() == "hello");
    for (int n = 0; n < 390; ++n) live.send(std::to_string(n));
    for (int n = 0; n < 390; ++n) CHECK(live.receive() == std::to_string(n));
}

TEST_CASE("WebSocket: an exception in a handler closes the client and is logged") {
    Handlers handlers;
    handlers.message = [](Client, std::string_view) { throw std::runtime_error("detail"); };
    Echo echo({}, handlers);
    Live live(echo.site());
    live.send("x");
    CHECK(live.closed_with() == 1011);
    CHECK(becomes_true([&] { return echo.log().count("closed 1") == 1; }));
    CHECK(echo.log().count("error message: detail") == 1);
}

TEST_CASE("WebSocket: clients beyond the maximum are rejected until another one leaves") {
    Options options;
    options.max_clients = 2;
    Echo echo(options);
    Live one(echo.site());
    auto two = std::make_unique<Live>(echo.site());
    CHECK(echo.site().get("/live", echo.site().upgrade()).result_int() == 503);
    two.reset();
    CHECK(becomes_true([&] { return echo.log().count("closed 2") == 1; }));
    Live three(echo.site());
    CHECK(three.receive() == "hello");
}

TEST_CASE("WebSocket: invalid handshakes are rejected") {
    Echo echo;
    Fields fields = echo.site().upgrade();
    fields[4] = {"Sec-WebSocket-Key", "-"};
    CHECK(echo.site().get("/live", fields).result_int() == 400);
    fields = echo.site().upgrade();
    fields[3].second = "12";
    CHECK(echo.site().get("/live", fields).result_int() == 426);
    HttpConnection early(echo.site().port);
    early.send(echo.site().head("/live", echo.site().upgrade()) + "early");
    CHECK(early.receive().result_int() == 400);
    CHECK(echo.log().lines().empty());
}

TEST_CASE("WebSocket: a client that does not read is closed, and other clients are not") {
    Options options;
    options.max_waiting_bytes = std::size_t(8) << 20;
    Echo echo(options);
    Live slow(echo.site());
    CHECK(slow.receive() == "hello");
    const Client first = echo.last();
    Live good(echo.site());
    CHECK(good.receive() == "hello");
    const std::string text(1 << 20, 'x');
    int sent = 0;
    while (echo.site().server.send(first, text)) REQUIRE(++sent < 100);
    CHECK(sent >= 8);
    CHECK(becomes_true([&] { return echo.log().count("closed 1") == 1; }));
    CHECK_FALSE(echo.site().server.send(first, "x"));
    good.send("still here");
    CHECK(good.receive() == "still here");
    CHECK(slow.closed_with() == 0);
}

TEST_CASE("WebSocket: a client that does not answer pings is closed after the idle time") {
    Options options;
    options.live_idle = std::chrono::milliseconds(400);
    Echo echo(options);
    Live silent(echo.site());  // it never reads, and therefore answers no pings
    CHECK(becomes_true([&] { return echo.log().count("closed 1") == 1; }));
    Live responsive(echo.site());
    CHECK(responsive.receive() == "hello");
    std::thread sender([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(1200));
        echo.site().server.broadcast("after a while");
    });
    CHECK(responsive.receive() == "after a while");
    sender.join();
}

TEST_CASE("WebSocket: slow HTTP requests do not delay messages") {
    std::promise<void> release;
    std::shared_future<void> released(release.get_future());
    std::atomic<int> waiting{0};
    Handlers handlers;
    handlers.get = [&](const Request&) {
        ++waiting;
        released.wait();
        return Response();
    };
    Echo echo({}, handlers);
    std::vector<std::unique_ptr<HttpConnection>> connections;
    for (int n = 0; n < 6; ++n) {
        connections.push_back(std::make_unique<HttpConnection>(echo.site().port));
        connections.back()->send(echo.site().head("/slice"));
    }
    REQUIRE(becomes_true([&] { return waiting == 4; }));
    Live live(echo.site());
    CHECK(live.receive() == "hello");
    live.send("now");
    CHECK(live.receive() == "now");
    release.set_value();
    for (auto& connection : connections) CHECK(connection->receive().result_int() == 200);
}

TEST_CASE("WebSocket: a slow handler receives all messages") {
    std::atomic<int> handled{0};
    Handlers handlers;
    handlers.message = [&](Client, std::string_view) {
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        ++handled;
    };
    Options options;
    options.messages_per_second = options.message_burst = 1e6;
    Echo echo(options, handlers);
    Live live(echo.site());
    for (int n = 0; n < 500; ++n) live.send(std::string(1000, 'x'));
    CHECK(becomes_true([&] { return handled == 500; }));
}

TEST_CASE("WebSocket: stopping the server informs the clients and takes less than a second") {
    CallRecorder log;
    Handlers handlers;
    handlers.opened = [&](Client client) { log.add("opened " + std::to_string(client.number)); };
    handlers.closed = [&](Client client) { log.add("closed " + std::to_string(client.number)); };
    auto site = std::make_unique<Site>(handlers);
    Live reading(*site), silent(*site);
    REQUIRE(becomes_true([&] { return log.count("opened") == 2; }));
    auto code = std::async(std::launch::async, [&] { return reading.closed_with(); });
    const auto start = Clock::now();
    site->server.stop();
    CHECK(Clock::now() - start < std::chrono::seconds(1));
    CHECK(code.get() == 1001);
    CHECK(log.count("closed") == 2);
    CHECK_FALSE(site->server.send(Client{1}, "x"));
    site->server.broadcast("x");
    site.reset();
}

TEST_CASE("WebSocket: clients connect and disconnect during broadcasts and requests") {
    Echo echo;
    std::atomic<bool> is_over{false};
    std::vector<std::thread> threads;
    for (int k = 0; k < 2; ++k) {
        threads.emplace_back([&] {
            while (!is_over) {
                echo.site().server.broadcast(std::string(3000, 'b'));
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            }
        });
    }
    for (int k = 0; k < 4; ++k) {
        threads.emplace_back([&, k] {
            for (int n = 0; n < 10; ++n) {
                Live live(echo.site());
                live.send("x");
                while (live.receive() != "x") {
                }
                if ((n + k) % 2 == 0) live.close();
                (void)echo.site().get("/image");
            }
        });
    }
    for (std::size_t k = 2; k < threads.size(); ++k) threads[k].join();
    is_over = true;
    threads[0].join();
    threads[1].join();
    CHECK(becomes_true([&] { return echo.log().count("closed") == 40; }));
}
