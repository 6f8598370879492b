#include "cli/system/process.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>

namespace covol::tool {

void keep_standard_streams() {
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (::fcntl(stream, F_GETFD) < 0 && errno == EBADF)
            // open() returns the lowest free number, which is that of this stream. Input is opened for writing and
            // output for reading, so that every use of the stream is an error.
            static_cast<void>(::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY));
}

std::string too_few_files() {
    constexpr rlim_t kMin = 16, kEnough = 4096;
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return {};
    if (limit.rlim_cur < std::min(limit.rlim_max, kEnough)) {
        limit.rlim_cur = std::min(limit.rlim_max, kEnough);
        static_cast<void>(::setrlimit(RLIMIT_NOFILE, &limit));
    }
    if (limit.rlim_cur >= kMin) return {};
    return "this process may open " + std::to_string(limit.rlim_cur) + " files at once (ulimit -n), expected " +
           std::to_string(kMin) + " or more; otherwise the run would fail with Too many open files";
}

void catch_signals(void (*handler)(int)) {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP})
        if (std::signal(signal, handler) == SIG_IGN) std::signal(signal, SIG_IGN);  // stays ignored, as with nohup
}

}  // namespace covol::tool
