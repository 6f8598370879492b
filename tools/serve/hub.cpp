#include "serve/hub.h"

#include "serve/http_connection.h"

namespace covol::serve {

// Two threads for messages, so that one slow handler does not block the other clients.
Hub::Hub(Options its_options, Handlers its_handlers)
    : options(std::move(its_options)),
      handlers(std::move(its_handlers)),
      get_pool(std::size_t(options.get_threads)),
      live_pool(2) {}

// Maximum number of connections beyond Options::max_connections that are refused with a message at the same time.
// Further ones are closed without an answer.
constexpr std::size_t kMaxRefused = 8;

void Hub::serve_socket(boost::asio::ip::tcp::socket socket) {
    bool has_room = connections_.size() < options.max_connections;
    if (!has_room) {
        // Browsers keep connections open for later requests, and other programs may hold idle ones. Neither may block a
        // connection that has a request.
        std::shared_ptr<Connection> longest;
        for (const auto& connection : connections_) {
            const auto since = connection->waits_since();
            if (since && (!longest || *since < *longest->waits_since())) longest = connection;
        }
        has_room = longest != nullptr;
        if (has_room) longest->finish();
    }
    const auto connection = std::make_shared<HttpConnection>(*this, std::move(socket));
    if (has_room) {
        enter(connection, false);
        connection->read();
    } else if (connections_.size() < options.max_connections + kMaxRefused) {
        enter(connection, false);
        connection->refuse(503, "Too many connections are open.");
    }
}

void Hub::enter(std::shared_ptr<Connection> connection, bool is_live) {
    if (connections_.insert(std::move(connection)).second && is_live) ++live_count_;
}

void Hub::leave(const std::shared_ptr<Connection>& connection, bool is_live) {
    if (connections_.erase(connection) != 0 && is_live) --live_count_;
}

void Hub::stop_all() {
    const auto all = connections_;  // a copy, because stop() removes connections
    for (const auto& connection : all) connection->stop();
}

void Hub::add_recipient(Client client, std::shared_ptr<Recipient> recipient) {
    const std::lock_guard lock(recipients_mutex_);
    recipients_.emplace(client, std::move(recipient));
}

void Hub::remove_recipient(Client client) {
    const std::lock_guard lock(recipients_mutex_);
    recipients_.erase(client);
}

bool Hub::send(Client client, std::string text) {
    if (is_stopping) return false;
    const auto shared = std::make_shared<const std::string>(std::move(text));
    const std::lock_guard lock(recipients_mutex_);
    const auto found = recipients_.find(client);
    return found != recipients_.end() && found->second->send(shared, false);
}

void Hub::broadcast(std::string text) {
    if (is_stopping) return;
    const auto shared = std::make_shared<const std::string>(std::move(text));
    // The lock is held for the whole loop, so that texts that two threads broadcast at the same time arrive in the same
    // order at all clients.
    const std::lock_guard lock(recipients_mutex_);
    for (const auto& [client, recipient] : recipients_) recipient->send(shared, true);
}

void Hub::report(const std::string& what) const {
    if (!handlers.on_error) return;
    try {
        handlers.on_error(what);
    } catch (...) {  // an error of the error handler cannot be reported
    }
}

std::string what_was_thrown() {
    try {
        throw;
    } catch (const std::exception& error) {
        return error.what();
    } catch (...) {
        return "an unknown exception";
    }
}

}  // namespace covol::serve
