#include "cli/system/child_run.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "cli/session.h"
#include "covol/error.h"

namespace covol::tool {
namespace fs = std::filesystem;
namespace {

/// Waits until the process that made the folder ends, then removes the folder. @param alive  read end of a pipe whose
/// other end is closed when that process ends
[[noreturn]] void keep(const fs::path& folder, int alive) {
    for (const int stop : {SIGINT, SIGTERM, SIGHUP}) std::signal(stop, SIG_IGN);
    ::setsid();  // a new session: signals to the process group do not reach this process
    // Open copies of inherited streams would keep their readers waiting, and inherited locks would stay locked.
    ::dup2(alive, STDIN_FILENO);
    ::close_range(STDIN_FILENO + 1, ~0U, 0);
    char nothing = 0;
    while (::read(STDIN_FILENO, &nothing, 1) < 0 && errno == EINTR) {
    }
    // A child run may still write files into the folder, so that it may have to be removed several times.
    constexpr int kMaxTries = 500, kPause = 10000;  // kPause in microseconds
    std::error_code status;
    for (int n = 0; n < kMaxTries; ++n) {
        fs::remove_all(folder, status);
        if (!fs::exists(fs::symlink_status(folder, status))) break;
        ::usleep(kPause);
    }
    ::_exit(0);
}

}  // namespace

KeptFolder::KeptFolder(const fs::path& beside) : folder_(beside) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return;
    cleaner_pid_ = ::fork();
    if (cleaner_pid_ == 0) keep(folder_->path(), ends[0]);
    ::close(ends[0]);
    pipe_ = ends[1];
}

KeptFolder::~KeptFolder() {
    folder_.reset();
    if (pipe_ < 0) return;
    ::close(pipe_);
    while (cleaner_pid_ > 0 && ::waitpid(cleaner_pid_, nullptr, 0) < 0 && errno == EINTR) {
    }
}

int run_this_program(const std::vector<std::string>& words, const RunContext& run) {
    const std::string self = fs::read_symlink("/proc/self/exe").string();
    std::vector<std::string> all{self};
    all.insert(all.end(), words.begin(), words.end());
    std::vector<char*> argv;
    for (std::string& word : all) argv.push_back(word.data());
    argv.push_back(nullptr);
    // SIGTERM is blocked until the child has the default handler: the handler that it inherits would not end the child.
    sigset_t term, before;
    sigemptyset(&term);
    sigaddset(&term, SIGTERM);
    ::pthread_sigmask(SIG_BLOCK, &term, &before);
    const pid_t parent = ::getpid(), child = ::fork();
    if (child == 0) ::signal(SIGTERM, SIG_DFL);
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
    if (child == 0) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (::getppid() == parent) ::execv(self.c_str(), argv.data());
        ::_exit(kIo);
    }
    if (child < 0) throw Error(Errc::Io, self + ": cannot start: " + std::strerror(errno));
    int status = 0;
    pid_t ended = 0;
    for (bool signalled = false; (ended = ::waitpid(child, &status, WNOHANG)) == 0;) {
        if (run.cancelled() && !signalled) signalled = ::kill(child, SIGTERM) == 0;
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    run.check();
    if (ended < 0) throw Error(Errc::Io, self + ": its exit code cannot be read: " + std::strerror(errno));
    return WIFEXITED(status) ? WEXITSTATUS(status) : kDefect;
}

}  // namespace covol::tool
