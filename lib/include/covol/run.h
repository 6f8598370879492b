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

/// How a computation runs, as opposed to what it computes: nothing in here changes a result.
struct RunContext {
    int threads =
        0;  ///< At most so many work, as far as there are cores; 0: those of the caller's TBB arena, all cores.

    /// Called from the calling thread with a stage's name and its fraction done in [0,1].
    std::function<void(const std::string& stage, double fraction)> progress;

    /// Called with one line of text; automatic choices come as Info. Lines name options as messages of errors do.
    std::function<void(LogLevel, const std::string& line)> log;

    /// Set from anywhere (a signal handler, say) to make the computation throw Errc::Cancelled
    /// or, where partial results are useful, return early and say so.
    const std::atomic<bool>* cancel = nullptr;

    /// Where the states of long flows are kept; null: nowhere.
    std::shared_ptr<Checkpoints> checkpoints;

    /// Bytes that may be taken; 0: no bound. What is sure to need more is refused before it takes any
    /// (Errc::InvalidOptions).
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

/// Runs `work` on at most run.threads threads (every TBB loop inside it, OpenVDB's own included): in a TBB arena of its
/// own, or in the one that the caller is in where that is as wide. What `work` throws passes through.
COVOL_API void with_threads(const RunContext& run, const std::function<void()>& work);

}  // namespace covol
