#pragma once
#include <atomic>
#include <cstdint>
#include <thread>

namespace covol::tool {

/// Resident memory of this process, bytes.
[[nodiscard]] std::uint64_t current_rss();
[[nodiscard]] std::uint64_t peak_rss();

/// Watches the resident memory and sets `cancel` when it passes the limit.
class MemoryGuard {
public:
    /// limit = 0: no guard.
    MemoryGuard(std::uint64_t limit, std::atomic<bool>& cancel);
    ~MemoryGuard();
    MemoryGuard(const MemoryGuard&) = delete;
    MemoryGuard& operator=(const MemoryGuard&) = delete;
    /// The limit was passed: the cancellation is ours.
    [[nodiscard]] bool tripped() const noexcept { return tripped_; }

private:
    std::atomic<bool> tripped_ = false;
    std::atomic<bool> done_ = false;
    std::thread watcher_;
};

}  // namespace covol::tool
