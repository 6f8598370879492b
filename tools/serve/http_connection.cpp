#include "serve/http_connection.h"

#include <sys/socket.h>

#include <boost/asio/post.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <limits>

#include "serve/answers.h"
#include "serve/live_connection.h"

namespace covol::serve {
namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace {

constexpr std::uint32_t kMaxHeaderBytes = 16 * 1024;

std::string_view view_of(beast::string_view text) { return {text.data(), text.size()}; }

RequestHead head_of(const http::request<http::empty_body>& request) {
    RequestHead head;
    head.method = view_of(request.method_string());
    head.target = view_of(request.target());
    for (const auto& field : request) head.fields.emplace_back(view_of(field.name_string()), view_of(field.value()));
    head.is_upgrade = beast::websocket::is_upgrade(request);
    return head;
}

}  // namespace

HttpConnection::HttpConnection(Hub& hub, asio::ip::tcp::socket socket)
    : hub_(hub), stream_(std::move(socket)), buffer_(4 * kMaxHeaderBytes) {}

void HttpConnection::read() {
    is_head_ = false;
    wants_to_stay_.reset();
    response_.reset();
    serializer_.reset();
    parser_.emplace();
    parser_->header_limit(kMaxHeaderBytes);
    // No limit is needed here, because judge() checks the length of the body. The limit is set to the largest number,
    // because Boost 1.74 interprets "none" as 0.
    if (hub_.rules.max_body_bytes > 0) parser_->body_limit(std::numeric_limits<std::uint64_t>::max());
    waits_since_ = std::chrono::steady_clock::now();
    stream_.expires_after(hub_.options.idle);
    http::async_read_header(stream_, buffer_, *parser_,
                            [self = self()](beast::error_code status, std::size_t) { self->on_read(status); });
}

void HttpConnection::on_read(beast::error_code status) {
    waits_since_.reset();
    if (!stream_.socket().is_open() || hub_.is_stopping) return finish();
    if (status == http::error::header_limit || status == http::error::buffer_overflow) {
        return refuse(431, "The header of a request may have at most " + std::to_string(kMaxHeaderBytes) + " bytes.");
    }
    if (status == http::error::body_limit) return refuse(413, "Requests must not have a body here.");
    const bool is_malformed = status.category() == make_error_code(http::error::bad_method).category() &&
                              status != http::error::end_of_stream && status != http::error::partial_message;
    if (status && is_malformed) return refuse(400, "This request is malformed.");
    if (status) return finish();  // the connection was closed, or timed out

    Decision judgement = judge(head_of(parser_->get()), hub_.rules);
    is_head_ = parser_->get().method() == http::verb::head;
    switch (judgement.kind) {
        case Decision::Kind::Refuse: return refuse(judgement.status, judgement.why);
        case Decision::Kind::SetCookie:
            return answer(cookie_answer(hub_.rules.cookie_name, hub_.rules.cookie, judgement.is_link), wants_to_stay());
        case Decision::Kind::Get: return call_handler(std::move(judgement.request));
        case Decision::Kind::Post: return take_body(std::move(judgement.request));
        case Decision::Kind::Live: return open_live();
    }
}

void HttpConnection::answer_with(const std::string& path, std::function<Response()> handler) {
    stream_.expires_never();
    asio::post(hub_.get_pool, [self = self(), path, handler = std::move(handler)]() mutable {
        Hub& hub = self->hub_;
        Response response;
        try {
            if (!hub.is_stopping) response = handler();
            if (const std::string why = why_unsendable(response); !why.empty()) {
                hub.report(path + ": " + why);
                response = refusal(500, "The request failed because of an internal error.");
            }
        } catch (...) {
            hub.report(path + ": " + what_was_thrown());
            response = refusal(500, "The request failed because of an internal error.");
        }
        handler = nullptr;  // releases the body of a POST now
        // `self` is moved, not copied: the last reference must be released on the thread of hub.io, where the socket
        // has to be destroyed.
        asio::post(hub.io, [self = std::move(self), response = std::move(response)]() mutable {
            self->end_post();
            beast::error_code ignored;
            self->stream_.socket().cancel(ignored);  // ends watch(), so that the next request can be read
            self->answer(std::move(response), self->wants_to_stay());
        });
    });
}

// Waits for the client to close the connection while its request is handled, sets `gone`, and closes it, too. A page
// closes the connection of a slice that it no longer needs because it displays another one.
void HttpConnection::watch(std::shared_ptr<std::atomic<bool>> gone) {
    stream_.socket().async_wait(asio::ip::tcp::socket::wait_read, [self = self(), gone](beast::error_code status) {
        char next = 0;
        // recv() returns 0 if the client has closed the connection. Available bytes belong to the next request.
        if (status || ::recv(self->stream_.socket().native_handle(), &next, 1, MSG_PEEK | MSG_DONTWAIT) != 0) return;
        *gone = true;
        self->finish();
    });
}

void HttpConnection::call_handler(Request request) {
    const auto gone = std::make_shared<std::atomic<bool>>(false);
    request.gone = gone;
    watch(gone);
    const std::string path = request.path;
    answer_with(path, [&hub = hub_, request = std::move(request)] {
        if (*request.gone) return Response{};
        return hub.handlers.get ? hub.handlers.get(request) : refusal(404, "There is nothing here.");
    });
}

void HttpConnection::take_body(Request request) {
    if (hub_.is_posting) return refuse(503, "Another file is being sent: try again when it has arrived.");
    hub_.is_posting = is_posting_ = true;
    wants_to_stay_ = parser_->get().version() == 11 && parser_->get().keep_alive();
    auto parser = std::make_shared<BodyParser>(std::move(*parser_));
    parser->body_limit(hub_.rules.max_body_bytes);
    read_body(std::move(parser), std::move(request));
}

// Reads the body in pieces. The time limit applies to each piece, because a large body may take long, as in write().
void HttpConnection::read_body(std::shared_ptr<BodyParser> parser, Request request) {
    stream_.expires_after(hub_.options.idle);
    BodyParser& into = *parser;
    http::async_read_some(stream_, buffer_, into,
                          [self = self(), parser = std::move(parser), request = std::move(request)](
                              beast::error_code status, std::size_t) mutable {
                              if (status || self->hub_.is_stopping) return self->finish();
                              if (!parser->is_done()) return self->read_body(std::move(parser), std::move(request));
                              const std::string path = request.path;
                              self->answer_with(
                                  path, [&hub = self->hub_, parser = std::move(parser), request = std::move(request)] {
                                      return hub.handlers.post(request, std::move(parser->get().body()));
                                  });
                          });
}

void HttpConnection::end_post() {
    if (is_posting_) hub_.is_posting = false;
    is_posting_ = false;
}

bool HttpConnection::wants_to_stay() const {
    return wants_to_stay_.value_or(parser_->get().version() == 11 && parser_->get().keep_alive());
}

void HttpConnection::open_live() {
    if (buffer_.size() != 0) return refuse(400, "Data arrived before the WebSocket was opened.");
    if (!hub_.has_room_for_client()) return refuse(503, "Too many windows are open.");
    const auto live = std::make_shared<LiveConnection>(hub_, std::move(stream_), hub_.next_client());
    hub_.leave(shared_from_this(), false);
    hub_.enter(live, true);
    live->accept(parser_->release());
}

void HttpConnection::refuse(int status, const std::string& why) { answer(refusal(status, why), false); }

void HttpConnection::answer(Response response, bool keep) {
    if (!stream_.socket().is_open()) return;
    keeps_ = keep;
    response_.emplace();
    response_->version(11);
    response_->result(unsigned(response.status));
    for (const auto& [name, value] : headers_of(response, hub_.options.page_policy)) response_->insert(name, value);
    response_->keep_alive(keep);
    const bool has_no_body = response.status == 204 || response.status == 304;
    if (!has_no_body) response_->content_length(response.body.size());
    if (!has_no_body && !is_head_) response_->body() = std::move(response.body);
    serializer_.emplace(*response_);
    write();
}

// Writes in pieces, so that the time limit applies to each piece: a large file may take long over a slow connection.
void HttpConnection::write() {
    stream_.expires_after(hub_.options.idle);
    http::async_write_some(stream_, *serializer_, [self = self()](beast::error_code status, std::size_t) {
        if (status) return self->finish();
        if (!self->serializer_->is_done()) return self->write();
        if (self->keeps_) return self->read();
        beast::error_code ignored;
        self->stream_.socket().shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
        self->stream_.expires_after(std::chrono::seconds(1));
        self->waits_since_ = std::chrono::steady_clock::now();
        self->drain();
    });
}

// Reads and ignores data until the client closes the connection. If this socket were closed before, the client might
// lose the answer.
void HttpConnection::drain() {
    constexpr std::size_t kMax = 1 << 20, kPiece = 4096;
    buffer_.consume(buffer_.size());
    stream_.async_read_some(buffer_.prepare(kPiece), [self = self()](beast::error_code status, std::size_t count) {
        self->drained_ += count;
        if (status || self->drained_ > kMax) return self->finish();
        self->drain();
    });
}

void HttpConnection::finish() {
    end_post();
    waits_since_.reset();
    stream_.close();
    hub_.leave(shared_from_this(), false);
}

}  // namespace covol::serve
