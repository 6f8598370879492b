#include "memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <fstream>

namespace covol::tool {
namespace {

constexpr auto kInterval = std::chrono::milliseconds(10);

}  // namespace

std::uint64_t current_rss() {
    std::ifstream statm("/proc/self/statm");
    std::uint64_t size = 0, resident = 0;
    statm >> size >> resident;
    return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

std::uint64_t peak_rss() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

MemoryGuard::MemoryGuard(std::uint64_t limit, std::atomic<bool>& cancel) {
    if (limit == 0) return;
    watcher_ = std::thread([this, limit, &cancel] {
        while (!done_) {
            if (current_rss() > limit) {
                tripped_ = true;
                cancel = true;
                return;
            }
            std::this_thread::sleep_for(kInterval);
        }
    });
}

MemoryGuard::~MemoryGuard() {
    done_ = true;
    if (watcher_.joinable()) watcher_.join();
}

}  // namespace covol::tool
