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

/// Settings of how a computation runs; none of them changes a result.
struct RunContext {
    /// Maximum number of threads, limited by the number of cores; 0: the threads of the caller's TBB arena, by default
    /// one for each core.
    int threads = 0;

    /// Called from the calling thread with the name of a stage and its completed fraction in [0,1].
    std::function<void(const std::string& stage, double fraction)> progress;

    /// Called with one line of text; automatic choices have level Info. Options are named as in error messages
    /// (option_names.h).
    std::function<void(LogLevel, const std::string& line)> log;

    /// Set this to true from any thread or a signal handler to cancel the computation: it throws Errc::Cancelled or, if
    /// partial results are useful, returns early and reports that.
    const std::atomic<bool>* cancel = nullptr;

    /// Saves the states of flows to disk; null: they are not saved.
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

/// Runs `work`, including all TBB loops in it and in OpenVDB, on at most run.threads threads: in a separate TBB arena,
/// or in the caller's arena if it has that number of threads. Exceptions of `work` are passed on.
COVOL_API void with_threads(const RunContext& run, const std::function<void()>& work);

}  // namespace covol
