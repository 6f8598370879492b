#include "covol/run.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

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
    if (run.threads <= 0) {
        work();
        return;
    }
    // The arena bounds the work; the control lets it have more threads than there are cores.
    const tbb::global_control allow(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(run.threads));
    tbb::task_arena arena(run.threads);
    arena.execute([&] { work(); });
}

}  // namespace covol
