#pragma once
#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <string>

namespace covol::serve {

/// A text that may be sent to several clients, stored once.
using SharedText = std::shared_ptr<const std::string>;

/// The texts that are queued for one client; their total size is limited. May be used from any thread, but only one
/// thread sends the texts with next() and written().
class Outbox {
public:
    enum class Added {
        Waiting,  ///< the writer is running, and will send the text
        First,    ///< the writer has to be started
        TooMuch,  ///< no more texts are accepted: the client must be disconnected
        Refused   ///< the queue is closed, or the text is a broadcast and these are not accepted yet
    };

    /// @param max_bytes  maximum size of all unsent texts; if the queue is empty, a single text may be larger
    explicit Outbox(std::size_t max_bytes) : max_bytes_(max_bytes) {}

    /// Adds a text. Broadcasts are refused before the first other text or take_broadcasts().
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

    /// Removes the text of next(), which has been sent. @return whether there is another one
    [[nodiscard]] bool written() {
        const std::lock_guard lock(mutex_);
        bytes_ -= texts_.front()->size();
        texts_.pop_front();
        return !texts_.empty();
    }

    /// Accepts no more texts. Queued texts are kept, because the writer may be sending one of them.
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
