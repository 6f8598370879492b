#include "cli/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <string>
#include <utility>

namespace covol::tool {
namespace {

constexpr auto kInterval = std::chrono::milliseconds(5);
constexpr std::uint64_t kSlack = 32;  // a part of the limit, for what ends by itself

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

MemoryGuard::MemoryGuard(std::uint64_t limit, std::atomic<bool>& cancel, std::function<void()> give_up) {
    if (limit == 0) return;
    watcher_ = std::thread([this, limit, &cancel, give_up = std::move(give_up)] {
        std::unique_lock lock(mutex_);
        while (!wake_.wait_for(lock, kInterval, [this] { return done_; })) {
            const std::uint64_t held = held_memory();
            if (held <= limit) continue;
            tripped_ = true;
            cancel = true;
            if (held > limit + limit / kSlack) give_up();
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
