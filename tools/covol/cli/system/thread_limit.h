#pragma once
#include <exception>

namespace covol::tool {

/// Numbers of threads that work at the same time, including the calling one.
struct ThreadCount {
    int wanted = 1, possible = 1;
};

/// Determines how many of the wanted threads the system can create (ulimit -u, pids.max of a control group). If it
/// cannot create all of them, TBB is limited to that number until the process ends, because the exception that TBB
/// throws when it cannot create a thread may end the process.
/// @param threads  the maximum number wanted; 0: as many as TBB uses by default, one for each core
[[nodiscard]] ThreadCount limit_threads(int threads);

/// Messages for a lack of memory, or of threads.
constexpr const char* kOutOfMemory = "out of memory; use a larger --voxel-size or a --roi";
constexpr const char* kNoThread =
    "the system allows no more threads or processes; see ulimit -u, and pids.max of the control group, or use fewer "
    "(--threads 1)";

/// Whether this was thrown because a thread cannot be created: by the standard library, or by TBB.
[[nodiscard]] bool is_missing_thread(const std::exception& error);

/// After this call, temporary files are removed if the process ends because of a lack of threads or memory.
void expect_temporary_files();

}  // namespace covol::tool
