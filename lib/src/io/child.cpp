#include "io/child.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstring>
#include <ctime>

namespace covol::detail {
namespace {

// One write to an empty pipe, which takes this much without a reader: the code, and the message.
void send(int pipe, const Error& error) {
    char text[PIPE_BUF];
    text[0] = static_cast<char>(error.code());
    const std::size_t length = std::min(std::strlen(error.what()), sizeof text - 1);
    std::memcpy(text + 1, error.what(), length);
    [[maybe_unused]] const ssize_t written = write(pipe, text, length + 1);
}

std::optional<Error> receive(int pipe) {
    char text[PIPE_BUF];
    const ssize_t length = read(pipe, text, sizeof text);
    if (length < 1) return std::nullopt;
    return Error(static_cast<Errc>(text[0]), std::string(text + 1, std::size_t(length) - 1));
}

[[noreturn]] void be_child(const std::function<void()>& work, int pipe) {
    for (const int crash : {SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSEGV}) std::signal(crash, SIG_DFL);
    for (const int stop : {SIGINT, SIGTERM, SIGHUP}) std::signal(stop, SIG_IGN);  // the parent's: not a crash
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const rlimit none{0, 0};
    setrlimit(RLIMIT_CORE, &none);
    if (const int null = open("/dev/null", O_RDWR); null >= 0)
        for (int standard = 0; standard < 3; ++standard) dup2(null, standard);
    try {
        work();
    } catch (const Error& error) {
        send(pipe, error);
    } catch (...) {
    }
    _exit(0);  // no destructor, no flush: all of that is the parent's
}

/// @return whether it ended by itself, within the time
bool wait_for(pid_t child, double seconds) {
    int status = 0;
    timespec pause{0, 100'000};
    double waited = 0;
    for (;;) {
        const pid_t ended = waitpid(child, &status, WNOHANG);
        if (ended == child) return WIFEXITED(status) && WEXITSTATUS(status) == 0;
        if (ended < 0 && errno != EINTR) return true;  // somebody else waited for it
        if (waited > seconds) break;
        nanosleep(&pause, nullptr);
        waited += 1e-9 * double(pause.tv_nsec);
        if (pause.tv_nsec < 20'000'000) pause.tv_nsec *= 2;
    }
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
    return false;
}

}  // namespace

Trial try_in_child(const std::function<void()>& work, double seconds) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0) return {};
    const pid_t child = fork();
    if (child == 0) be_child(work, ends[1]);
    close(ends[1]);
    Trial trial;
    if (child > 0) {
        trial.crashed = !wait_for(child, seconds);
        trial.refused = receive(ends[0]);
    }
    close(ends[0]);
    return trial;
}

void try_reading(const std::string& path, const char* library, const std::function<void()>& read) {
    constexpr double kSeconds = 60;
    const Trial trial = try_in_child(read, kSeconds);
    if (trial.crashed)
        throw Error(Errc::InvalidInput,
                    "read_image: " + path + ": damaged: the " + library + " library cannot read it");
    if (trial.refused) throw Error(*trial.refused);
}

}  // namespace covol::detail
