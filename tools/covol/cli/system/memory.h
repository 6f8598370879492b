#pragma once
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace covol::tool {

// Resident memory of this process, bytes.
[[nodiscard]] std::uint64_t held_memory();  ///< at present, without mapped files
[[nodiscard]] std::uint64_t peak_rss();     ///< maximum so far

/// The maximum memory of a run.
struct MemoryBound {
    std::uint64_t bytes = 0;  ///< 0: the free memory is unknown, and the memory is not limited
    std::string name;         ///< for messages: "--memory-limit 8G", or the free memory and what limits it
};

/// Parses the text of --memory-limit. If it is empty, the bound is the memory that this process has, plus 80 % of the
/// free memory; the remaining 20 % are left to other processes and to the page cache.
/// @throws Error InvalidOptions
[[nodiscard]] MemoryBound choose_memory_bound(const std::string& given);

/// Monitors the memory of this process (without mapped files, which the system can reclaim) and sets `cancel` when it
/// exceeds the limit. If it then grows further, for example in a library that cannot be cancelled, the process is
/// ended.
class MemoryGuard {
public:
    /// Monitors nothing if limit = 0, or if the system cannot create a thread.
    /// @param give_up  ends the process; called on the thread of the guard
    MemoryGuard(std::uint64_t limit, std::atomic<bool>& cancel, std::function<void()> give_up);
    ~MemoryGuard();
    MemoryGuard(const MemoryGuard&) = delete;
    MemoryGuard& operator=(const MemoryGuard&) = delete;
    /// False if the system could not create the guard's thread, so that the memory is not monitored.
    [[nodiscard]] bool watches() const noexcept { return watches_; }
    /// Whether the limit was exceeded, so that this guard has set `cancel`.
    [[nodiscard]] bool tripped() const noexcept { return tripped_; }

private:
    std::atomic<bool> tripped_ = false;
    bool done_ = false, watches_ = true;
    std::mutex mutex_;
    std::condition_variable wake_;
    std::thread watcher_;
};

}  // namespace covol::tool
