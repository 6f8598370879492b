#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "covol/api.h"

namespace covol {

class Checkpoints;

enum class LogLevel { Info, Warning };

/// How a computation runs, as opposed to what it computes: nothing here changes a result.
struct RunContext {
    /// Maximum number of threads, limited by the cores; 0: those of the caller's TBB arena, all cores.
    int threads = 0;

    /// Called from the calling thread with the name of a stage and its completed fraction in [0,1].
    std::function<void(const std::string& stage, double fraction)> progress;

    /// Called with one line of text; automatic choices have level Info. Options are named as in messages of errors.
    std::function<void(LogLevel, const std::string& line)> log;

    /// Set from anywhere (a signal handler, for example) to make the computation throw Errc::Cancelled or, if partial
    /// results are useful, return early and report it.
    const std::atomic<bool>* cancel = nullptr;

    /// Where the states of long flows are saved; null: nowhere.
    std::shared_ptr<Checkpoints> checkpoints;

    /// Maximum number of bytes that may be allocated; 0: unlimited. A computation that certainly needs more fails
    /// before it allocates any (Errc::InvalidOptions).
    std::uint64_t memory_budget = 0;

    [[nodiscard]] bool cancelled() const noexcept {
        return cancel != nullptr && cancel->load(std::memory_order_relaxed);
    }
    COVOL_API void info(const std::string& line) const;
    COVOL_API void warn(const std::string& line) const;
    COVOL_API void report(const std::string& stage, double fraction) const;
    /// @throws Error Cancelled when cancelled().
    COVOL_API void check() const;
};

/// Runs `work` on at most run.threads threads (including every TBB loop inside it, OpenVDB's own too): in a separate
/// TBB arena, or in the caller's if it has that many threads. Exceptions of `work` are passed on.
COVOL_API void with_threads(const RunContext& run, const std::function<void()>& work);

}  // namespace covol
