#pragma once
#include <tbb/global_control.h>

#include <memory>

namespace covol::tool {

/// Keeps TBB from asking for threads that the system does not make (ulimit -u, pids.max of a control group): TBB makes
/// its threads where an exception ends the process.
class ThreadLimit {
public:
    /// Tries how many can be made, and holds TBB to that many while this object lives.
    /// @param threads  that may be wanted, with the calling one; 0: one for each core
    explicit ThreadLimit(int threads);
    ~ThreadLimit();
    ThreadLimit(const ThreadLimit&) = delete;
    ThreadLimit& operator=(const ThreadLimit&) = delete;

    /// That are wanted and that there can be, with the calling one.
    [[nodiscard]] int wanted() const noexcept { return wanted_; }
    [[nodiscard]] int possible() const noexcept { return possible_; }

private:
    int wanted_, possible_;
    std::unique_ptr<tbb::global_control> control_;
};

/// What to say where the system makes no thread.
constexpr const char* kNoThread =
    "the system makes no more threads or processes; see ulimit -u, and pids.max of the control group, or use fewer "
    "(--threads 1)";

/// From here on a thread that cannot be made where no exception is caught ends the process with that error, exit code 4
/// and no temporary files.
void tell_of_missing_threads();

}  // namespace covol::tool
