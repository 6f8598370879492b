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

// A web server for one user's browser, on the loopback address of this machine: HTTP for requests, WebSockets for
// messages in both directions. The server controls who has access; handlers compute the answers.
namespace covol::serve {

/// A GET, HEAD or POST that passed all checks.
struct Request {
    std::string path;                          ///< decoded, begins with '/'
    std::map<std::string, std::string> query;  ///< decoded, UTF-8 without NUL
    /// Becomes true if the client closes the connection before it has received the answer: the handler can then stop
    /// computing it.
    std::shared_ptr<const std::atomic<bool>> gone{};
};

/// The answer of a handler. The server adds the length and all headers that protect the page.
struct Response {
    int status = 200;                                            ///< 200 to 599
    std::string type = "text/plain; charset=utf-8";              ///< Content-Type
    std::string body{};                                          ///< for HEAD only its length is sent
    bool is_deflated = false;                                    ///< `body` is a zlib stream of content of that type
    std::vector<std::pair<std::string, std::string>> headers{};  ///< further headers, such as `X-Width`
    std::string file_name{};  ///< UTF-8; if it is not empty, the browser saves the body as a file of that name
};

/// One WebSocket, identified by a number that is not used again.
struct Client {
    std::uint64_t number = 0;
    friend auto operator<=>(const Client&, const Client&) = default;
};

/// Functions that the server calls, on its own threads; each may be empty. For one client, they are called one after
/// another: `opened`, then each `message` in order, then `closed`. For different clients they are called concurrently,
/// as is `get`. A slow handler delays the next ones of its client, and two slow ones delay those of all clients: long
/// computations should run on another thread. Handlers may call send() and broadcast(), but not stop().
struct Handlers {
    std::function<Response(const Request&)> get{};  ///< may be slow; if it throws, the answer is 500 without details
    /// A POST with its body, one at a time, if Options::max_body_bytes > 0. Otherwise like `get`.
    std::function<Response(const Request&, std::string body)> post{};
    std::function<void(Client)> opened{};
    std::function<void(Client, std::string_view)> message{};  ///< UTF-8; if it throws, its WebSocket is closed (1011)
    std::function<void(Client)> closed{};                     ///< exactly once for each client that was `opened`
    std::function<void(const std::string&)> on_error{};  ///< errors in a handler or in accepting connections, for a log
};

/// The address of the server, and limits for the requests of one user's browser.
struct Options {
    std::uint16_t port = 0;  ///< 0: any free port
    /// Further values of `Host`, `name:port`, that a page may be loaded from, such as the local end of a forwarded
    /// port.
    std::vector<std::string> authorities{};
    /// Origins, "http://localhost:8888", of pages that may show the page in a frame: notebooks on this machine.
    std::vector<std::string> frame_origins{};
    std::string page_policy = "default-src 'none'";  ///< Content-Security-Policy of text/html, without frame-ancestors
    std::string live_path = "/live";                 ///< path of WebSockets
    std::size_t max_message_bytes = std::size_t(4) << 20;  ///< of a message that a client sends, >= 1
    std::size_t max_body_bytes = 0;                        ///< of a POST; 0: all POSTs are refused
    /// Maximum of a client's unsent data; with more, the client is disconnected.
    std::size_t max_waiting_bytes = std::size_t(64) << 20;
    /// Maximum number of open connections, >= 1, including WebSockets. For a further one, the connection that has been
    /// waiting longest for a request is closed; if none is waiting, the new one is refused (503).
    std::size_t max_connections = 16;
    std::size_t max_clients = 8;                  ///< maximum number of open WebSockets
    double messages_per_second = 200;             ///< > 0, for each client; with more, it is disconnected (1008)
    double message_burst = 400;                   ///< >= 1, maximum number of messages at once
    std::chrono::milliseconds idle{30'000};       ///< >= 1, maximum time without request or progress of an answer
    std::chrono::milliseconds live_idle{60'000};  ///< >= 2, maximum time to answer a ping, and for handlers to catch up
    int get_threads = 4;                          ///< >= 1: concurrent calls of `get`

    /// Empty if valid, otherwise the reason: "port: expected ...".
    [[nodiscard]] std::string why_invalid() const;
};

/// Listens on 127.0.0.1 during its lifetime.
///
/// Only clients that have opened the link of url() get a cookie, and requests without the cookie are refused. A request
/// also has to name this server as its `Host`, and, if it states its origin, to come from a page of this server.
/// Therefore other users of this machine, and pages of other sites in the same browser, get no data.
class WebServer {
public:
    /// Answers requests from now on.
    /// @throws Error  InvalidOptions; Io (the port is taken; no random numbers; no sockets or threads).
    WebServer(Options options, Handlers handlers);
    ~WebServer();  ///< calls stop()
    WebServer(const WebServer&) = delete;
    WebServer& operator=(const WebServer&) = delete;

    [[nodiscard]] std::uint16_t port() const;
    /// The link to open, "http://127.0.0.1:PORT/?token=...": it is a secret, and works as long as the server runs.
    [[nodiscard]] std::string url() const;

    /// Sends a text, UTF-8, to a client. May be called from any thread; texts arrive in the order of the calls.
    /// @return false if the client has left, or is closed now because too much data is queued for it
    bool send(Client client, std::string text);
    /// Sends a text to all clients. The order is the same for all of them, even if threads call this concurrently. A
    /// client gets broadcasts from the first send() to it on, and at the latest when `opened` has returned: the texts
    /// that `opened` sends arrive first.
    void broadcast(std::string text);

    /// Closes all connections, and waits until all threads have ended: for the running handlers, and less than a second
    /// more. Pending requests and messages are discarded; `closed` is called for each client.
    /// May be called from any thread except the handlers', and more than once.
    void stop();

private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace covol::serve
