#pragma once
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/serializer.hpp>
#include <boost/beast/http/string_body.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "serve/hub.h"

namespace covol::serve {

/// A socket that handles HTTP requests, one after another, until it becomes a WebSocket or is closed.
class HttpConnection final : public Connection {
public:
    HttpConnection(Hub& hub, boost::asio::ip::tcp::socket socket);

    /// Waits for a request. @pre this object is owned by a shared pointer
    void read();
    /// Answers with a message, and closes the connection.
    void refuse(int status, const std::string& why);

    void stop() override { finish(); }
    void finish() override;
    [[nodiscard]] std::optional<MessageRate::Time> waits_since() const override { return waits_since_; }

private:
    using Stream = boost::beast::tcp_stream;
    using BodyParser = boost::beast::http::request_parser<boost::beast::http::string_body>;
    using StringResponse = boost::beast::http::response<boost::beast::http::string_body>;

    [[nodiscard]] std::shared_ptr<HttpConnection> self() {
        return std::static_pointer_cast<HttpConnection>(shared_from_this());
    }
    void on_read(boost::beast::error_code status);
    void call_handler(Request request);
    void watch(std::shared_ptr<std::atomic<bool>> gone);
    void take_body(Request request);
    void read_body(std::shared_ptr<BodyParser> parser, Request request);
    /// Calls `handler` on a thread of the pool for handlers, and answers with the returned response.
    void answer_with(const std::string& path, std::function<Response()> handler);
    void end_post();
    void open_live();
    [[nodiscard]] bool wants_to_stay() const;
    /// @param keep  whether the connection stays open
    void answer(Response response, bool keep);
    void write();
    void drain();

    Hub& hub_;
    Stream stream_;
    boost::beast::flat_buffer buffer_;
    std::optional<boost::beast::http::request_parser<boost::beast::http::empty_body>> parser_;
    std::optional<StringResponse> response_;
    std::optional<boost::beast::http::response_serializer<boost::beast::http::string_body>> serializer_;
    bool is_head_ = false, keeps_ = false, is_posting_ = false;
    // Result of wants_to_stay() for a POST, stored because parser_ is moved before the answer; otherwise nullopt.
    std::optional<bool> wants_to_stay_;
    std::size_t drained_ = 0;
    std::optional<MessageRate::Time> waits_since_;
};

}  // namespace covol::serve
