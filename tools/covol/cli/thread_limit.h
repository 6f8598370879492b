#pragma once
#include <exception>

namespace covol::tool {

/// Threads that work at once, with the calling one.
struct ThreadCount {
    int wanted = 1, possible = 1;
};

/// Tries how many threads the system makes (ulimit -u, pids.max of a control group), and holds TBB to that many from
/// here on: TBB makes its threads where an exception may end the process.
/// @param threads  that may be wanted; 0: one for each core
[[nodiscard]] ThreadCount limit_threads(int threads);

/// What to say if there is no memory, or the system makes no thread.
constexpr const char* kOutOfMemory = "out of memory; use a larger --voxel-size or a --roi";
constexpr const char* kNoThread =
    "the system makes no more threads or processes; see ulimit -u, and pids.max of the control group, or use fewer "
    "(--threads 1)";

/// Whether this was thrown because a thread cannot be made: by the standard library, or by TBB.
[[nodiscard]] bool is_missing_thread(const std::exception& error);

/// The program has begun: from here on there may be temporary files to remove where it ends for want of a thread.
void expect_temporary_files();

}  // namespace covol::tool
