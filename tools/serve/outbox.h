#pragma once
#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <string>

namespace covol::serve {

/// A text that several clients may be sent, kept once.
using SharedText = std::shared_ptr<const std::string>;

/// The texts that wait to be written to one client, of limited size. From any thread; one of them writes.
class Outbox {
public:
    enum class Added {
        Waiting,  ///< the writer will come to it
        First,    ///< the writer has to be started
        TooMuch,  ///< no more is taken from now on: the client has to be closed
        Refused   ///< it was closed, or is not ready for broadcasts
    };

    /// @param max_bytes  of the texts that are not written yet; a single one may be larger where nothing else waits
    explicit Outbox(std::size_t max_bytes) : max_bytes_(max_bytes) {}

    /// The first text for this client alone makes it ready for broadcasts.
    [[nodiscard]] Added add(SharedText text, bool is_broadcast) {
        const std::lock_guard lock(mutex_);
        if (is_closed_ || (is_broadcast && !takes_broadcasts_)) return Added::Refused;
        takes_broadcasts_ = true;
        const bool is_first = texts_.empty();
        if (!is_first && (text->size() > max_bytes_ || bytes_ > max_bytes_ - text->size())) {
            is_closed_ = true;
            return Added::TooMuch;
        }
        bytes_ += text->size();
        texts_.push_back(std::move(text));
        return is_first ? Added::First : Added::Waiting;
    }

    void take_broadcasts() {
        const std::lock_guard lock(mutex_);
        takes_broadcasts_ = true;
    }

    /// The text to write. @pre there is one
    [[nodiscard]] SharedText next() const {
        const std::lock_guard lock(mutex_);
        return texts_.front();
    }

    /// The text of next() is written. @return whether there is another one
    [[nodiscard]] bool written() {
        const std::lock_guard lock(mutex_);
        bytes_ -= texts_.front()->size();
        texts_.pop_front();
        return !texts_.empty();
    }

    /// Takes no more; what waits stays for the writer that may be at it.
    void close() {
        const std::lock_guard lock(mutex_);
        is_closed_ = true;
    }

private:
    mutable std::mutex mutex_;
    std::deque<SharedText> texts_;
    const std::size_t max_bytes_;
    std::size_t bytes_ = 0;
    bool takes_broadcasts_ = false, is_closed_ = false;
};

}  // namespace covol::serve
