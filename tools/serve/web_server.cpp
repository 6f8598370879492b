#include "serve/web_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <cstring>
#include <thread>

#include "covol/error.h"
#include "serve/answers.h"
#include "serve/hub.h"
#include "serve/request_rules.h"
#include "serve/secret.h"

namespace covol::serve {
namespace asio = boost::asio;
using asio::ip::tcp;
namespace {

[[noreturn]] void fail_to_listen(std::uint16_t port, int number) {
    const std::string what = "port " + std::to_string(port) + " of 127.0.0.1: ";
    if (number == EADDRINUSE) {
        throw Error(Errc::Io, what + "another program listens there: choose another port, or 0 for one that is free",
                    "port");
    }
    if (number == EACCES) {
        throw Error(Errc::Io, what + "only administrators may listen there: choose one from 1024 on", "port");
    }
    throw Error(Errc::Io, what + std::strerror(number));
}

// The socket is created without Asio: child processes, such as a browser, would inherit a socket of Asio, and keep it
// open while they run.
int listen_on(std::uint16_t port) {
    const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (socket < 0) fail_to_listen(port, errno);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int yes = 1;  // allows the port to be reused while connections of an earlier run are ending
    constexpr int kBacklog = 64;
    if (::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
        ::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        ::listen(socket, kBacklog) != 0) {
        const int number = errno;
        ::close(socket);
        fail_to_listen(port, number);
    }
    return socket;
}

Options checked(Options options) {
    if (const std::string why = options.why_invalid(); !why.empty()) {
        throw Error(Errc::InvalidOptions, why);
    }
    // frame-ancestors has priority over X-Frame-Options, which cannot permit single origins.
    options.page_policy += "; frame-ancestors";
    for (const std::string& one : options.frame_origins) options.page_policy += " " + one;
    if (options.frame_origins.empty()) options.page_policy += " 'none'";
    return options;
}

}  // namespace

std::string Options::why_invalid() const {
    for (const std::string& one : authorities) {
        if (!is_authority(one)) return "authorities: expected name:port, got \"" + one + "\"";
    }
    for (const std::string& one : frame_origins) {
        constexpr std::string_view kScheme = "http://";
        if (!one.starts_with(kScheme) || !is_authority(std::string_view(one).substr(kScheme.size())))
            return "frame_origins: expected http://name:port, got \"" + one + "\"";
    }
    if (page_policy.empty() || !is_header_value(page_policy)) return "page_policy: expected one line";
    if (live_path.size() < 2 || live_path[0] != '/') return "live_path: expected /name, got \"" + live_path + "\"";
    if (max_message_bytes < 1) return "max_message_bytes: expected >= 1, got 0";
    if (max_connections < 1) return "max_connections: expected >= 1, got 0";
    if (!(messages_per_second > 0)) {
        return "messages_per_second: expected > 0, got " + std::to_string(messages_per_second);
    }
    if (!(message_burst >= 1)) return "message_burst: expected >= 1, got " + std::to_string(message_burst);
    if (idle.count() < 1) return "idle: expected >= 1 ms, got " + std::to_string(idle.count());
    if (live_idle.count() < 2) return "live_idle: expected >= 2 ms, got " + std::to_string(live_idle.count());
    if (get_threads < 1) return "get_threads: expected >= 1, got " + std::to_string(get_threads);
    return {};
}

class WebServer::Impl {
public:
    Impl(Options options, Handlers handlers)
        : hub_(checked(std::move(options)), std::move(handlers)), acceptor_(hub_.io), pause_(hub_.io) {
        acceptor_.assign(tcp::v4(), listen_on(hub_.options.port));
        port_ = acceptor_.local_endpoint().port();
        hub_.rules.authorities = allowed_authorities(port_, hub_.options.authorities);
        hub_.rules.token = random_secret();
        hub_.rules.cookie = random_secret();  // not the token, because links appear in histories and process lists
        hub_.rules.cookie_name = "covol_mark_" + std::to_string(port_);
        hub_.rules.live_path = hub_.options.live_path;
        hub_.rules.may_be_framed = !hub_.options.frame_origins.empty();
        hub_.rules.max_body_bytes = hub_.handlers.post ? hub_.options.max_body_bytes : 0;
        wait();
        thread_ = std::thread([this] { serve(); });
    }

    ~Impl() { stop(); }
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    void stop() {
        std::call_once(stopped_, [this] {
            hub_.is_stopping = true;
            asio::post(hub_.io, [this] {
                boost::system::error_code ignored;
                acceptor_.close(ignored);
                pause_.cancel();
                hub_.stop_all();
            });
            thread_.join();  // ends when the last socket is closed
            hub_.get_pool.join();
            hub_.live_pool.join();
        });
    }

    [[nodiscard]] Hub& hub() { return hub_; }
    [[nodiscard]] std::uint16_t port() const { return port_; }

private:
    void serve() {
        while (true) {
            try {
                hub_.io.run();
                return;
            } catch (...) {  // such as lack of memory: only one connection is affected
                hub_.report(what_was_thrown());
            }
        }
    }

    void wait() {
        acceptor_.async_wait(tcp::acceptor::wait_read, [this](boost::system::error_code status) {
            if (hub_.is_stopping || !acceptor_.is_open()) return;
            if (status || accept_all()) return wait();
            // The limit of open files has been reached: try again when some have been closed.
            pause_.expires_after(std::chrono::milliseconds(100));
            pause_.async_wait([this](boost::system::error_code) {
                if (!hub_.is_stopping) wait();
            });
        });
    }

    // Accepts the pending connections. @return false if none can be accepted at present
    bool accept_all() {
        constexpr int kMax = 64;  // connections in one call, before other events are handled
        for (int n = 0; n < kMax; ++n) {
            const int accepted = ::accept4(acceptor_.native_handle(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
            if (accepted < 0) {
                const bool is_short = errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM;
                if (is_short && !was_short_) hub_.report(std::string("accept: ") + std::strerror(errno));
                was_short_ = is_short;
                return !is_short;
            }
            was_short_ = false;
            boost::system::error_code status;
            tcp::socket socket(hub_.io);
            socket.assign(tcp::v4(), accepted, status);
            if (status) {
                ::close(accepted);
                continue;
            }
            socket.set_option(tcp::no_delay(true), status);
            hub_.serve_socket(std::move(socket));
        }
        return true;
    }

    Hub hub_;
    tcp::acceptor acceptor_;
    asio::steady_timer pause_;
    std::uint16_t port_ = 0;
    bool was_short_ = false;
    std::once_flag stopped_;
    std::thread thread_;
};

WebServer::WebServer(Options options, Handlers handlers) {
    try {
        impl_ = std::make_unique<Impl>(std::move(options), std::move(handlers));
    } catch (const Error&) {
        throw;
    } catch (const std::exception& error) {  // from sockets and threads
        throw Error(Errc::Io, error.what());
    }
}

WebServer::~WebServer() = default;

std::uint16_t WebServer::port() const { return impl_->port(); }

std::string WebServer::url() const {
    return "http://127.0.0.1:" + std::to_string(impl_->port()) + "/?token=" + impl_->hub().rules.token;
}

bool WebServer::send(Client client, std::string text) { return impl_->hub().send(client, std::move(text)); }

void WebServer::broadcast(std::string text) { impl_->hub().broadcast(std::move(text)); }

void WebServer::stop() { impl_->stop(); }

}  // namespace covol::serve
