#pragma once
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>

namespace covol::tool {

/// Resident memory of this process, bytes.
[[nodiscard]] std::uint64_t held_memory();  ///< without mapped files
[[nodiscard]] std::uint64_t peak_rss();

/// Memory that this process can still take, bytes: of the machine and of its control group; 0 where nobody says.
[[nodiscard]] std::uint64_t available_memory();

/// Watches the memory that this process holds (without mapped files, which the system takes back) and sets `cancel`
/// when it passes the limit. What goes on beyond it, in a library that knows nothing of cancellation, is given up.
class MemoryGuard {
public:
    /// limit = 0: no guard. @param give_up  ends the process; called by the guard's thread
    MemoryGuard(std::uint64_t limit, std::atomic<bool>& cancel, std::function<void()> give_up);
    ~MemoryGuard();
    MemoryGuard(const MemoryGuard&) = delete;
    MemoryGuard& operator=(const MemoryGuard&) = delete;
    /// The limit was passed: the cancellation is ours.
    [[nodiscard]] bool tripped() const noexcept { return tripped_; }

private:
    std::atomic<bool> tripped_ = false;
    bool done_ = false;
    std::mutex mutex_;
    std::condition_variable wake_;
    std::thread watcher_;
};

}  // namespace covol::tool
