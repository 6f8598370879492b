#include "cli/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <string>

namespace covol::tool {
namespace {

constexpr auto kInterval = std::chrono::milliseconds(10);

}  // namespace

std::uint64_t held_memory() {
    std::ifstream statm("/proc/self/statm");
    std::uint64_t size = 0, resident = 0, shared = 0;
    statm >> size >> resident >> shared;
    return (resident - std::min(shared, resident)) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

std::uint64_t peak_rss() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

std::uint64_t available_memory() {
    std::uint64_t available = 0;
    std::ifstream machine("/proc/meminfo");
    for (std::string name, unit; machine >> name;) {
        std::uint64_t kilobytes = 0;
        machine >> kilobytes;
        std::getline(machine, unit);
        if (name == "MemAvailable:") available = kilobytes * 1024;
    }
    // The caches of a control group count as its use and are given back on demand: only its limit is sure.
    for (const char* path : {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
        std::uint64_t limit = 0;
        if (std::ifstream(path) >> limit) available = std::min(available, limit);
    }
    return available;
}

MemoryGuard::MemoryGuard(std::uint64_t limit, std::atomic<bool>& cancel) {
    if (limit == 0) return;
    watcher_ = std::thread([this, limit, &cancel] {
        std::unique_lock lock(mutex_);
        while (!wake_.wait_for(lock, kInterval, [this] { return done_; }))
            if (held_memory() > limit) {
                tripped_ = true;
                cancel = true;
                return;
            }
    });
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
