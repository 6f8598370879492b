#include "cli/system/memory.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "cli/options/arguments.h"
#include "cli/system/free_memory.h"

namespace covol::tool {
namespace {

// Interval between two checks of MemoryGuard. A process allocates at some gigabytes per second, so that it can grow by
// some megabytes in this time. One check takes two microseconds.
constexpr auto kInterval = std::chrono::milliseconds(1);
constexpr std::uint64_t kSlack = 32;  // a cancelled run may exceed the limit by 1/32 before the process is ended
constexpr std::uint64_t kUsablePercent = 80;

/// Reads the number of pages of this process repeatedly.
class PageCount {
public:
    PageCount() : file_(::open("/proc/self/statm", O_RDONLY | O_CLOEXEC)) {}
    ~PageCount() {
        if (file_ >= 0) ::close(file_);
    }
    PageCount(const PageCount&) = delete;
    PageCount& operator=(const PageCount&) = delete;

    /// Resident memory without mapped files, bytes; 0 if the system does not report it.
    [[nodiscard]] std::uint64_t held() const {
        std::array<char, 128> text{};  // size resident shared ...
        if (file_ < 0 || ::pread(file_, text.data(), text.size() - 1, 0) <= 0) return 0;
        std::array<std::uint64_t, 3> pages{};
        char* at = text.data();
        for (std::uint64_t& count : pages) count = std::strtoull(at, &at, 10);
        return (pages[1] - std::min(pages[2], pages[1])) * page_;
    }

private:
    int file_;
    std::uint64_t page_ = static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
};

}  // namespace

std::uint64_t held_memory() { return PageCount().held(); }

std::uint64_t peak_rss() {
    // VmHWM is preferred to ru_maxrss, which may be the maximum of the process that started this program.
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with("VmHWM:")) return std::strtoull(line.c_str() + 6, nullptr, 10) * 1024;
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

MemoryBound choose_memory_bound(const std::string& given) {
    if (!given.empty()) return {parse_bytes("--memory-limit", given), "--memory-limit " + given};
    const std::optional<FreeMemory> free = find_free_memory();
    if (!free) return {};
    const std::uint64_t bytes = std::max<std::uint64_t>(1, held_memory() + free->bytes / 100 * kUsablePercent);
    return {bytes, std::to_string(bytes >> 20) + " MiB, " + std::to_string(kUsablePercent) + " % of what " +
                       free->where + " has free (--memory-limit sets another bound)"};
}

MemoryGuard::MemoryGuard(std::uint64_t limit, std::atomic<bool>& cancel, std::function<void()> give_up) {
    if (limit == 0) return;
    const auto watch = [this, limit, &cancel, give_up = std::move(give_up)] {
        const PageCount pages;
        std::unique_lock lock(mutex_);
        while (!wake_.wait_for(lock, kInterval, [this] { return done_; })) {
            const std::uint64_t held = pages.held();
            if (held <= limit) continue;
            tripped_ = true;
            cancel = true;
            if (held > limit + limit / kSlack) give_up();
        }
    };
    try {
        watcher_ = std::thread(watch);
    } catch (const std::system_error&) {
        watches_ = false;
    }
}

MemoryGuard::~MemoryGuard() {
    {
        const std::lock_guard lock(mutex_);
        done_ = true;
    }
    wake_.notify_all();
    if (watcher_.joinable()) watcher_.join();
}

}  // namespace covol::tool
