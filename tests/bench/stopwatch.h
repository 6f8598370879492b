#pragma once
#include <sys/resource.h>

#include <chrono>

namespace covol::bench {

/// Seconds since construction: wall clock, and user and system time of all threads.
class Stopwatch {
public:
    [[nodiscard]] double wall() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }
    [[nodiscard]] double cpu() const { return used() - cpu_begin_; }

private:
    using Clock = std::chrono::steady_clock;
    static double used() {
        rusage usage{};
        ::getrusage(RUSAGE_SELF, &usage);
        const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
        return seconds(usage.ru_utime) + seconds(usage.ru_stime);
    }
    Clock::time_point begin_ = Clock::now();
    double cpu_begin_ = used();
};

}  // namespace covol::bench
