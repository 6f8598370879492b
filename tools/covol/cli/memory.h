#pragma once
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace covol::tool {

/// Resident memory of this process, bytes.
[[nodiscard]] std::uint64_t held_memory();  ///< without mapped files
[[nodiscard]] std::uint64_t peak_rss();

/// What a run may hold.
struct MemoryBound {
    std::uint64_t bytes = 0;  ///< 0: nobody knows
    std::string name;         ///< for messages: "--memory-limit 8G", or what is free and where
};

/// Of the text of --memory-limit; of an empty one four fifths of what is free now, beside what this process holds:
/// the rest is for other processes, and for the pages of files.
/// @throws Error InvalidOptions
[[nodiscard]] MemoryBound choose_memory_bound(const std::string& given);

/// Watches the memory that this process holds (without mapped files, which the system takes back) and sets `cancel`
/// when it passes the limit. What goes on beyond it, in a library that knows nothing of cancellation, is given up.
class MemoryGuard {
public:
    /// limit = 0, or the system makes no thread: no guard. @param give_up  ends the process; called by the guard's
    /// thread
    MemoryGuard(std::uint64_t limit, std::atomic<bool>& cancel, std::function<void()> give_up);
    ~MemoryGuard();
    MemoryGuard(const MemoryGuard&) = delete;
    MemoryGuard& operator=(const MemoryGuard&) = delete;
    /// False where the system makes no thread for it.
    [[nodiscard]] bool watches() const noexcept { return watches_; }
    /// The limit was passed: the cancellation is ours.
    [[nodiscard]] bool tripped() const noexcept { return tripped_; }

private:
    std::atomic<bool> tripped_ = false;
    bool done_ = false, watches_ = true;
    std::mutex mutex_;
    std::condition_variable wake_;
    std::thread watcher_;
};

}  // namespace covol::tool
