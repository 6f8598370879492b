#include "covol/run.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>

#include "covol/error.h"

namespace covol {

void RunContext::info(const std::string& line) const {
    if (log) log(LogLevel::Info, line);
}
void RunContext::warn(const std::string& line) const {
    if (log) log(LogLevel::Warning, line);
}
void RunContext::report(const std::string& stage, double fraction) const {
    if (progress) progress(stage, fraction);
}
void RunContext::check() const {
    if (cancelled()) throw Error(Errc::Cancelled, "cancelled");
}

void with_threads(const RunContext& run, const std::function<void()>& work) {
    // TBB prints a warning if an arena requests more threads than the process may use.
    const auto maximum = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    const int width = std::min(run.threads, int(maximum));
    if (run.threads <= 0 || width == tbb::this_task_arena::max_concurrency()) {
        work();
        return;
    }
    tbb::task_arena(width).execute([&] { work(); });
}

}  // namespace covol
