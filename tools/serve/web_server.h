#pragma once
#include <atomic>
#include <chrono>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

// A web server for one person's browser, on the loopback address of this machine: HTTP for what is fetched, WebSockets
// for messages in both directions. It knows who may ask; what is answered is up to its handlers.
namespace covol::serve {

/// A GET, HEAD or POST that passed all checks.
struct Request {
    std::string path;                          ///< decoded, begins with '/'
    std::map<std::string, std::string> query;  ///< decoded, UTF-8 without NUL
    /// Becomes true if the client closes the connection before it has the answer: nobody waits for it any more.
    std::shared_ptr<const std::atomic<bool>> gone{};
};

/// What a handler answers. The server adds the length and all headers that protect the page.
struct Response {
    int status = 200;                                            ///< 200 to 599
    std::string type = "text/plain; charset=utf-8";              ///< Content-Type
    std::string body{};                                          ///< for HEAD its length alone is sent
    bool is_deflated = false;                                    ///< the body is a zlib stream of what `type` says
    std::vector<std::pair<std::string, std::string>> headers{};  ///< further ones, `X-Width` say
    std::string file_name{};  ///< UTF-8; where there is one, the browser saves the body as a file of that name
};

/// One WebSocket, by a number that is not used again.
struct Client {
    std::uint64_t number = 0;
    friend auto operator<=>(const Client&, const Client&) = default;
};

/// What the server calls, on its own threads. Those of one client are called one after another: `opened`, then each
/// `message` in its order, then `closed`; those of different clients, and `get`, at the same time. Each may be empty.
/// One that is slow delays the next ones of its client, and others when more than two clients are slow: long work
/// belongs on a thread of the caller's. They may call send() and broadcast(), but not stop().
struct Handlers {
    std::function<Response(const Request&)>
        get{};  ///< may be slow; what it throws becomes an answer 500 without details
    /// A POST with its body, one at a time, where Options::max_body_bytes allows any; as `get`.
    std::function<Response(const Request&, std::string body)> post{};
    std::function<void(Client)> opened{};
    std::function<void(Client, std::string_view)> message{};  ///< UTF-8; where it throws, the client is closed (1011)
    std::function<void(Client)> closed{};                     ///< exactly once for each client that was `opened`
    std::function<void(const std::string&)> on_error{};  ///< what went wrong in a handler or in accepting, for a log
};

/// Where to listen, and what one person's browser may ask for.
struct Options {
    std::uint16_t port = 0;  ///< 0: one that is free
    /// Further values of `Host`, `name:port`, that a page may be loaded from, such as the other end of a forwarded
    /// port.
    std::vector<std::string> authorities{};
    /// Origins, "http://localhost:8888", whose pages may show the page in a frame: notebooks on this machine.
    std::vector<std::string> frame_origins{};
    std::string page_policy = "default-src 'none'";  ///< Content-Security-Policy of text/html, without frame-ancestors
    std::string live_path = "/live";                 ///< where WebSockets are opened
    std::size_t max_message_bytes = std::size_t(4) << 20;   ///< of a message that a client sends, >= 1
    std::size_t max_body_bytes = 0;                         ///< of a POST; 0: none is answered
    std::size_t max_waiting_bytes = std::size_t(64) << 20;  ///< that a client has not read yet: with more it is closed
    /// Open at once, >= 1, WebSockets among them. One more closes the one that waits longest for a request; where none
    /// waits it is refused (503).
    std::size_t max_connections = 16;
    std::size_t max_clients = 8;                  ///< WebSockets open at once
    double messages_per_second = 200;             ///< > 0, of each client: with more it is closed (1008)
    double message_burst = 400;                   ///< >= 1: so many at once
    std::chrono::milliseconds idle{30'000};       ///< >= 1: without a request, or without progress of an answer
    std::chrono::milliseconds live_idle{60'000};  ///< >= 2: in which a client answers a ping, and its handlers catch up
    int get_threads = 4;                          ///< >= 1: so many calls of `get` at once

    /// Empty when usable, else what is wrong: "port: expected ...".
    [[nodiscard]] std::string why_invalid() const;
};

/// Listens on 127.0.0.1 as long as it lives.
///
/// Who has the link of url() gets a cookie, and nobody is answered without it. A request also has to name this server
/// as its `Host`, and to come from a page of the server's own where it says where it comes from. So other people on
/// this machine, and pages of other sites in the same browser, get nothing.
class WebServer {
public:
    /// Answers from now on.
    /// @throws Error  InvalidOptions; Io (the port is taken; no random numbers; no sockets or threads).
    WebServer(Options options, Handlers handlers);
    ~WebServer();  ///< as stop()
    WebServer(const WebServer&) = delete;
    WebServer& operator=(const WebServer&) = delete;

    [[nodiscard]] std::uint16_t port() const;
    /// The link to open, "http://127.0.0.1:PORT/?token=...": it is a secret, and works as long as the server runs.
    [[nodiscard]] std::string url() const;

    /// Sends a text, UTF-8, to a client. From any thread; texts to one client arrive in the order of the calls.
    /// @return false where the client is gone, or is closed now since too much waits for it
    bool send(Client client, std::string text);
    /// Sends a text to all clients, in an order that is the same for all of them where threads call this at the same
    /// time. A client gets broadcasts from the first send() to it on, and at the latest from when `opened` has
    /// returned: what `opened` sends is the first that it gets.
    void broadcast(std::string text);

    /// Closes all connections and waits for its threads, which takes less than a second beside the handlers that are
    /// running: those are waited for. Requests and messages that wait for a handler are dropped; `closed` is called for
    /// each client. From any thread but the handlers', and more than once.
    void stop();

private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace covol::serve
