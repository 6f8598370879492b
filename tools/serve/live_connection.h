#pragma once
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "serve/hub.h"
#include "serve/message_rate.h"
#include "serve/outbox.h"

namespace covol::serve {

/// A socket that has become a WebSocket. Unless stated otherwise, functions are called on the thread of Hub::io.
class LiveConnection final : public Connection, public Recipient {
public:
    LiveConnection(Hub& hub, boost::beast::tcp_stream stream, Client client);

    /// Answers the handshake and serves the client. @pre this object is owned by a shared pointer
    void accept(boost::beast::http::request<boost::beast::http::empty_body> request);
    void stop() override;
    void finish() override;
    [[nodiscard]] std::optional<MessageRate::Time> waits_since() const override { return std::nullopt; }
    /// May be called from any thread.
    bool send(const SharedText& text, bool is_broadcast) override;

private:
    using Strand = boost::asio::strand<boost::asio::thread_pool::executor_type>;

    [[nodiscard]] std::shared_ptr<LiveConnection> self() {
        return std::static_pointer_cast<LiveConnection>(shared_from_this());
    }
    void on_accept(boost::beast::error_code status);
    void read();
    void on_read(boost::beast::error_code status);
    [[nodiscard]] bool is_too_fast();
    /// Calls a handler, and closes the connection if it throws. Called on a thread of the pool for handlers.
    template <typename Call>
    void call(const char* name, const Call& handler);
    static void release(std::shared_ptr<LiveConnection> self);
    void on_handled(std::size_t bytes);
    [[nodiscard]] bool has_much_to_handle() const;
    void write();
    void on_write(boost::beast::error_code status);
    /// Stops reading and writing, and closes after `maximum` at the latest.
    void close_after(std::chrono::milliseconds maximum);
    /// Sends the reason, waits at most `maximum` for the client's answer and closes.
    void close(boost::beast::websocket::close_code code, const char* why, std::chrono::milliseconds maximum);

    Hub& hub_;
    boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
    const Client client_;
    Strand handlers_;  // runs the handlers of this client one at a time, in order
    boost::asio::steady_timer deadline_;
    boost::beast::http::request<boost::beast::http::empty_body> handshake_;
    boost::beast::flat_buffer buffer_;
    MessageRate rate_;
    Outbox outbox_;
    SharedText written_;  // keeps the text alive while it is written
    std::size_t unhandled_ = 0, unhandled_bytes_ = 0;
    bool is_open_ = false, is_closing_ = false, is_finished_ = false;
    bool is_reading_ = false, pauses_ = false;
};

}  // namespace covol::serve
