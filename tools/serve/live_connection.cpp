#include "serve/live_connection.h"

#include <boost/asio/post.hpp>
#include <boost/beast/core/buffers_to_string.hpp>

#include "serve/answers.h"

namespace covol::serve {
namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
namespace {

constexpr std::chrono::milliseconds kPartingTime{2000};

}  // namespace

LiveConnection::LiveConnection(Hub& hub, beast::tcp_stream stream, Client client)
    : hub_(hub),
      socket_(std::move(stream)),
      client_(client),
      handlers_(asio::make_strand(hub.live_pool.get_executor())),
      deadline_(hub.io),
      rate_(hub.options.messages_per_second, hub.options.message_burst),
      outbox_(hub.options.max_waiting_bytes) {}

void LiveConnection::accept(http::request<http::empty_body> request) {
    handshake_ = std::move(request);
    beast::get_lowest_layer(socket_).expires_never();  // the WebSocket has its own timeouts
    websocket::stream_base::timeout limits{};
    limits.handshake_timeout = std::chrono::seconds(10);
    limits.idle_timeout = hub_.options.live_idle;
    limits.keep_alive_pings = true;
    socket_.set_option(limits);
    socket_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
        for (const auto& [name, value] : protecting_headers("default-src 'none'")) response.set(name, value);
    }));
    // Sizes are checked in on_read(): Beast would close without reading the remaining data, and the client would not
    // receive the reason.
    socket_.read_message_max(0);
    socket_.auto_fragment(false);
    socket_.text(true);
    // Pings are counted as messages for the limit of messages per second, because they take as much time.
    socket_.control_callback([this](websocket::frame_type kind, beast::string_view) {
        if (kind == websocket::frame_type::close || !is_too_fast()) return;
        asio::post(hub_.io, [self = self()] {
            self->close(websocket::close_code::policy_error, "too many messages", kPartingTime);
        });
    });
    socket_.async_accept(handshake_, [self = self()](beast::error_code status) { self->on_accept(status); });
}

template <typename Call>
void LiveConnection::call(const char* name, const Call& handler) {
    try {
        handler();
    } catch (...) {
        hub_.report(std::string(name) + ": " + what_was_thrown());
        asio::post(hub_.io, [self = self()] {
            self->close(websocket::close_code::internal_error, "something went wrong", kPartingTime);
        });
    }
}

// Releases a reference to a connection on the thread of Hub::io: if it is the last one, the socket is destroyed, which
// has to happen on that thread.
void LiveConnection::release(std::shared_ptr<LiveConnection> self) {
    asio::io_context& io = self->hub_.io;
    asio::post(io, [self = std::move(self)] {});
}

void LiveConnection::on_accept(beast::error_code status) {
    if (status || is_finished_ || hub_.is_stopping) return finish();
    is_open_ = true;
    hub_.add_recipient(client_, self());
    asio::post(handlers_, [self = self()]() mutable {
        if (self->hub_.handlers.opened) self->call("opened", [&] { self->hub_.handlers.opened(self->client_); });
        self->outbox_.take_broadcasts();
        release(std::move(self));
    });
    read();
}

void LiveConnection::read() {
    is_reading_ = true;
    constexpr std::size_t kPiece = 65536;
    socket_.async_read_some(buffer_, kPiece,
                            [self = self()](beast::error_code status, std::size_t) { self->on_read(status); });
}

bool LiveConnection::is_too_fast() { return !rate_.allows_one(std::chrono::steady_clock::now()); }

bool LiveConnection::has_much_to_handle() const {
    constexpr std::size_t kMaxMessages = 64;
    return unhandled_ >= kMaxMessages || unhandled_bytes_ >= 2 * hub_.options.max_message_bytes;
}

void LiveConnection::on_read(beast::error_code status) {
    is_reading_ = false;
    if (status) return finish();
    if (is_closing_) return;  // async_close() reads until the client's answer
    if (buffer_.size() > hub_.options.max_message_bytes) {
        return close(websocket::close_code::too_big, "a message is too large", kPartingTime);
    }
    if (!socket_.is_message_done()) return read();
    if (is_too_fast()) return close(websocket::close_code::policy_error, "too many messages", kPartingTime);
    if (!socket_.got_text()) return close(websocket::close_code::unknown_data, "expected text", kPartingTime);
    std::string text = beast::buffers_to_string(buffer_.data());
    buffer_.consume(buffer_.size());
    ++unhandled_;
    unhandled_bytes_ += text.size();
    asio::post(handlers_, [self = self(), text = std::move(text)]() mutable {
        Hub& hub = self->hub_;
        if (!hub.is_stopping && hub.handlers.message) {
            self->call("message", [&] { hub.handlers.message(self->client_, text); });
        }
        asio::post(hub.io, [self = std::move(self), bytes = text.size()] { self->on_handled(bytes); });
    });
    // Reading pauses while many messages are queued for the handlers. This limits the memory for the queue.
    pauses_ = has_much_to_handle();
    if (!pauses_) read();
}

void LiveConnection::on_handled(std::size_t bytes) {
    --unhandled_;
    unhandled_bytes_ -= bytes;
    if (!pauses_ || is_closing_ || is_finished_ || has_much_to_handle()) return;
    pauses_ = false;
    read();
}

bool LiveConnection::send(const SharedText& text, bool is_broadcast) {
    switch (outbox_.add(text, is_broadcast)) {
        case Outbox::Added::Waiting: return true;
        case Outbox::Added::First: asio::post(hub_.io, [self = self()] { self->write(); }); return true;
        case Outbox::Added::TooMuch: asio::post(hub_.io, [self = self()] { self->finish(); }); return false;
        case Outbox::Added::Refused: return false;
    }
    return false;
}

void LiveConnection::write() {
    if (is_closing_ || is_finished_) return;
    written_ = outbox_.next();
    socket_.async_write(asio::buffer(*written_),
                        [self = self()](beast::error_code status, std::size_t) { self->on_write(status); });
}

void LiveConnection::on_write(beast::error_code status) {
    if (is_closing_ || is_finished_) return;
    if (status) return is_reading_ ? close_after(kPartingTime) : finish();
    if (outbox_.written()) write();
}

void LiveConnection::close(websocket::close_code code, const char* why, std::chrono::milliseconds maximum) {
    if (is_finished_) return;
    const bool was_closing = is_closing_;
    close_after(maximum);
    if (was_closing) return;
    socket_.async_close({code, why}, [self = self()](beast::error_code status) {
        if (!status || !self->is_reading_) self->finish();
    });
}

// If the client closes or sends invalid UTF-8, the read operation itself answers this, and writing fails from then on.
// The read operation has to be completed: if the socket is closed before, the client may not receive the answer.
void LiveConnection::close_after(std::chrono::milliseconds maximum) {
    is_closing_ = true;
    outbox_.close();
    deadline_.expires_after(maximum);
    deadline_.async_wait([self = self()](beast::error_code status) {
        if (status != asio::error::operation_aborted) self->finish();
    });
}

void LiveConnection::stop() {
    if (!is_open_) return finish();
    close(websocket::close_code::going_away, "the program ends", Hub::kCloseTimeout);
}

void LiveConnection::finish() {
    if (is_finished_) return;
    is_finished_ = true;
    outbox_.close();
    deadline_.cancel();
    beast::get_lowest_layer(socket_).close();
    hub_.leave(shared_from_this(), true);
    if (!is_open_) return;
    hub_.remove_recipient(client_);
    asio::post(handlers_, [self = self()]() mutable {
        if (self->hub_.handlers.closed) self->call("closed", [&] { self->hub_.handlers.closed(self->client_); });
        release(std::move(self));
    });
}

}  // namespace covol::serve
