#pragma once
// A server under test, and clients that send what a browser or others would send.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "serve/web_server.h"

namespace serve_test {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Answer = http::response<http::string_body>;
using Fields = std::vector<std::pair<std::string, std::string>>;

/// Whether the condition becomes true within ten seconds.
inline bool becomes_true(const std::function<bool()>& is_true) {
    for (int n = 0; n < 1000; ++n) {
        if (is_true()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
}

/// Records the calls of handlers as lines of text.
class CallRecorder {
public:
    void add(const std::string& text) {
        const std::lock_guard lock(mutex_);
        lines_.push_back(text);
    }
    [[nodiscard]] std::vector<std::string> lines() const {
        const std::lock_guard lock(mutex_);
        return lines_;
    }
    [[nodiscard]] std::size_t count(const std::string& part) const {
        std::size_t found = 0;
        for (const std::string& line : lines()) found += line.find(part) != std::string::npos ? 1U : 0U;
        return found;
    }

private:
    mutable std::mutex mutex_;
    std::vector<std::string> lines_;
};

/// One connection that sends and receives HTTP.
class HttpConnection {
public:
    explicit HttpConnection(std::uint16_t port) : socket_(io_) {
        socket_.connect({asio::ip::address_v4::loopback(), port});
    }
    void send(const std::string& bytes) { asio::write(socket_, asio::buffer(bytes)); }
    /// Receives the next answer. @param is_head  the request is a HEAD, so that the answer has no body
    Answer receive(bool is_head = false) {
        http::response_parser<http::string_body> parser;
        parser.body_limit(std::uint64_t(1) << 30);
        parser.skip(is_head);
        http::read(socket_, buffer_, parser);
        return parser.release();
    }
    /// Waits until the server closes the connection. @return whether it has
    bool is_at_end() {
        beast::error_code status;
        char byte = 0;
        (void)socket_.read_some(asio::buffer(&byte, 1), status);
        return status == asio::error::eof || status == asio::error::connection_reset;
    }

private:
    asio::io_context io_;
    asio::ip::tcp::socket socket_;
    beast::flat_buffer buffer_;
};

using LiveSocket = websocket::stream<asio::ip::tcp::socket>;

/// A server and one browser that has opened its link.
class Site {
public:
    explicit Site(covol::serve::Handlers handlers, covol::serve::Options options = {})
        : server(std::move(options), std::move(handlers)), port(server.port()) {
        host = "127.0.0.1:" + std::to_string(port);
        token = server.url().substr(server.url().find('=') + 1);
        HttpConnection connection(port);
        connection.send("GET /?token=" + token + " HTTP/1.1\r\nHost: " + host + "\r\n\r\n");
        const std::string set(connection.receive()[http::field::set_cookie]);
        cookie = set.substr(0, set.find(';'));
    }

    /// The head of a request with some fields changed; one with the value "-" is left out.
    [[nodiscard]] std::string head(const std::string& target, const Fields& changes = {},
                                   const std::string& method = "GET") const {
        Fields fields{{"Host", host}, {"Cookie", cookie}};
        for (const auto& [name, value] : changes) {
            std::erase_if(fields, [&, &same = name](const auto& field) { return field.first == same; });
            if (value != "-") fields.emplace_back(name, value);
        }
        std::string text = method + " " + target + " HTTP/1.1\r\n";
        for (const auto& [name, value] : fields) text += name + ": " + value + "\r\n";
        return text + "\r\n";
    }
    [[nodiscard]] Answer get(const std::string& target, const Fields& changes = {},
                             const std::string& method = "GET") const {
        HttpConnection connection(port);
        connection.send(head(target, changes, method));
        return connection.receive(method == "HEAD");
    }
    [[nodiscard]] Fields upgrade() const {
        return {{"Origin", "http://" + host},
                {"Connection", "keep-alive, Upgrade"},
                {"Upgrade", "websocket"},
                {"Sec-WebSocket-Version", "13"},
                {"Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="}};
    }

    covol::serve::WebServer server;
    std::uint16_t port;
    std::string host, token, cookie;
};

/// A page's WebSocket.
class Live {
public:
    explicit Live(const Site& site) : socket_(io_) {
        socket_.next_layer().connect({asio::ip::address_v4::loopback(), site.port});
        socket_.set_option(websocket::stream_base::decorator([&](websocket::request_type& request) {
            request.set(http::field::cookie, site.cookie);
            request.set(http::field::origin, "http://" + site.host);
        }));
        socket_.read_message_max(std::size_t(256) << 20);
        socket_.handshake(answer, site.host, "/live");
        socket_.text(true);
    }
    void send(const std::string& text) { socket_.write(asio::buffer(text)); }
    std::string receive() {
        beast::flat_buffer buffer;
        socket_.read(buffer);
        return beast::buffers_to_string(buffer.data());
    }
    /// Reads to the end. @return the server's reason for closing: a number of RFC 6455, or 0 if it sent none
    unsigned closed_with() {
        beast::error_code status;
        while (!status) {
            beast::flat_buffer buffer;
            socket_.read(buffer, status);
        }
        return status == websocket::error::closed ? socket_.reason().code : 0U;
    }
    void close() { socket_.close(websocket::close_code::normal); }
    LiveSocket& socket() { return socket_; }

    websocket::response_type answer;

private:
    asio::io_context io_;
    LiveSocket socket_;
};

}  // namespace serve_test
