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

/// One open socket. All of it runs on the thread of Hub::io.
class Connection : public std::enable_shared_from_this<Connection> {
public:
    virtual ~Connection() = default;
    /// Closes within Hub::kGoodbye.
    virtual void stop() = 0;
    /// Since when it waits for a request, or for the client to close; nothing where it is at work.
    [[nodiscard]] virtual std::optional<MessageRate::Time> waits_since() const = 0;
    /// Closes at once.
    virtual void finish() = 0;
};

/// What serves one WebSocket, as far as other threads may call it.
class Recipient {
public:
    virtual ~Recipient() = default;
    virtual bool send(const SharedText& text, bool is_broadcast) = 0;
};

/// What the connections of a server share. Where nothing else is said, functions are for the thread of `io`.
class Hub {
public:
    /// How long a client that is told of the end may take to answer.
    static constexpr std::chrono::milliseconds kGoodbye{300};

    Hub(Options options, Handlers handlers);

    const Options options;
    const Handlers handlers;
    Rules rules{};                         ///< complete before the first connection
    std::atomic<bool> is_stopping{false};  ///< any thread
    bool is_posting = false;               ///< a body is being read or handled: it may be large
    /// Where handlers run. Two pools: however many pictures are being read, messages are answered.
    boost::asio::thread_pool get_pool, live_pool;
    boost::asio::io_context io{1};  // after the pools: what it holds to the end still names them

    /// Serves an accepted socket. Where there is no room it closes the one that waits longest for a request, and if all
    /// are at work refuses the new one.
    void welcome(boost::asio::ip::tcp::socket socket);
    /// @return whether one more WebSocket is allowed
    [[nodiscard]] bool has_room_for_client() const { return live_count_ < options.max_clients; }
    [[nodiscard]] Client next_client() { return {++last_client_}; }
    void enter(std::shared_ptr<Connection> connection, bool is_live);
    /// Nothing happens where it has left before.
    void leave(const std::shared_ptr<Connection>& connection, bool is_live);
    void stop_all();

    /// For send() and broadcast() from now on.
    void add_recipient(Client client, std::shared_ptr<Recipient> recipient);
    void remove_recipient(Client client);
    /// Any thread.
    bool send(Client client, std::string text);
    void broadcast(std::string text);

    /// Any thread: tells `on_error`, and nobody where that throws.
    void report(const std::string& what) const;

private:
    std::set<std::shared_ptr<Connection>> connections_;
    std::size_t live_count_ = 0;
    std::uint64_t last_client_ = 0;
    std::mutex recipients_mutex_;
    std::map<Client, std::shared_ptr<Recipient>> recipients_;
};

/// What an exception says. @pre within a handler of one
[[nodiscard]] std::string what_was_thrown();

}  // namespace covol::serve
