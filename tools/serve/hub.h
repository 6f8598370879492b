#pragma once
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/thread_pool.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "serve/message_rate.h"
#include "serve/outbox.h"
#include "serve/request_rules.h"
#include "serve/web_server.h"

namespace covol::serve {

/// One open socket. All functions are called on the thread of Hub::io.
class Connection : public std::enable_shared_from_this<Connection> {
public:
    virtual ~Connection() = default;
    /// Closes the connection within Hub::kCloseTimeout.
    virtual void stop() = 0;
    /// The time at which the connection began to wait for a request, or for the client to close it; nullopt while it is
    /// busy.
    [[nodiscard]] virtual std::optional<MessageRate::Time> waits_since() const = 0;
    /// Closes the connection at once.
    virtual void finish() = 0;
};

/// The functions of a WebSocket connection that other threads may call.
class Recipient {
public:
    virtual ~Recipient() = default;
    virtual bool send(const SharedText& text, bool is_broadcast) = 0;
};

/// State that the connections of a server share. Unless stated otherwise, functions are called on the thread of `io`.
class Hub {
public:
    /// Maximum time that a client has to answer a closing message.
    static constexpr std::chrono::milliseconds kCloseTimeout{300};

    Hub(Options options, Handlers handlers);

    const Options options;
    const Handlers handlers;
    Rules rules{};                         ///< set before the first connection
    std::atomic<bool> is_stopping{false};  ///< may be used by any thread
    bool is_posting = false;               ///< a POST is being read or handled; one at a time, as bodies may be large
    /// Threads of handlers. There are two pools, so that messages are answered while many images are being read.
    boost::asio::thread_pool get_pool, live_pool;
    boost::asio::io_context io{1};  // destroyed before the pools, to which its pending handlers refer

    /// Serves an accepted socket. If there are too many connections, closes the one that has been waiting longest for a
    /// request, or refuses the new one if all are busy.
    void serve_socket(boost::asio::ip::tcp::socket socket);
    /// @return whether one more WebSocket is allowed
    [[nodiscard]] bool has_room_for_client() const { return live_count_ < options.max_clients; }
    [[nodiscard]] Client next_client() { return {++last_client_}; }
    void enter(std::shared_ptr<Connection> connection, bool is_live);
    /// Removes a connection that enter() has added; has no effect if it has been removed before.
    void leave(const std::shared_ptr<Connection>& connection, bool is_live);
    void stop_all();

    /// Includes the client in send() and broadcast() from now on.
    void add_recipient(Client client, std::shared_ptr<Recipient> recipient);
    void remove_recipient(Client client);
    /// May be called from any thread.
    bool send(Client client, std::string text);
    void broadcast(std::string text);

    /// Calls `on_error`, and ignores its exceptions. May be called from any thread.
    void report(const std::string& what) const;

private:
    std::set<std::shared_ptr<Connection>> connections_;
    std::size_t live_count_ = 0;
    std::uint64_t last_client_ = 0;
    std::mutex recipients_mutex_;
    std::map<Client, std::shared_ptr<Recipient>> recipients_;
};

/// The message of an exception. @pre called within a catch block
[[nodiscard]] std::string what_was_thrown();

}  // namespace covol::serve
