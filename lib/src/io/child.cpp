#include "io/child.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <ctime>

namespace covol::detail {
namespace {

[[noreturn]] void be_child(const std::function<void()>& work) {
    for (const int crash : {SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSEGV}) std::signal(crash, SIG_DFL);
    for (const int stop : {SIGINT, SIGTERM, SIGHUP}) std::signal(stop, SIG_IGN);  // the parent's: not a crash
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const rlimit none{0, 0};
    setrlimit(RLIMIT_CORE, &none);
    if (const int null = open("/dev/null", O_RDWR); null >= 0)
        for (int standard = 0; standard < 3; ++standard) dup2(null, standard);
    try {
        work();
    } catch (...) {
    }
    _exit(0);  // no destructor, no flush: all of that is the parent's
}

}  // namespace

Trial try_in_child(const std::function<void()>& work, double seconds) {
    const pid_t child = fork();
    if (child < 0) return Trial::Ended;
    if (child == 0) be_child(work);
    int status = 0;
    timespec pause{0, 100'000};
    double waited = 0;
    for (;;) {
        const pid_t ended = waitpid(child, &status, WNOHANG);
        if (ended == child) return WIFEXITED(status) && WEXITSTATUS(status) == 0 ? Trial::Ended : Trial::Crashed;
        if (ended < 0 && errno != EINTR) return Trial::Ended;  // somebody else waited for it
        if (waited > seconds) break;
        nanosleep(&pause, nullptr);
        waited += 1e-9 * double(pause.tv_nsec);
        if (pause.tv_nsec < 20'000'000) pause.tv_nsec *= 2;
    }
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
    return Trial::Crashed;
}

}  // namespace covol::detail
