#include "cli/system/cancel_signals.h"

#include <unistd.h>

#include <csignal>

#include "cli/exit_codes.h"
#include "cli/system/process.h"

namespace covol::tool {
namespace {

// The only variables that the signal handler changes. They must be lock-free: a handler must not wait for a lock.
std::atomic<bool> cancel_requested = false;
std::atomic<bool> interrupted = false;
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void on_signal(int signal) {
    interrupted = true;
    cancel_requested = true;
    std::signal(signal, SIG_DFL);  // a second signal ends the program at once
}

/// Called if a page of a mapped file does not exist any more, because another program truncated the file. Finished
/// outputs are kept; the temporary files of this run are removed by the next run.
extern "C" void on_bus_error(int) {
    constexpr char kText[] =
        "covol: error: a file that is being read was cut short by another program; run covol again\n";
    static_cast<void>(!::write(STDERR_FILENO, kText, sizeof kText - 1));
    ::_exit(kIo);
}

}  // namespace

std::atomic<bool>& cancel_flag() { return cancel_requested; }

bool is_interrupted() { return interrupted; }

void accept_interrupt() {
    if (interrupted) cancel_requested = false;
}

void catch_cancel_signals() { catch_signals(on_signal); }

void catch_file_signals() {
    std::signal(SIGBUS, on_bus_error);
    std::signal(SIGXFSZ, SIG_IGN);  // if the limit of file sizes is exceeded, write() then returns an error
}

}  // namespace covol::tool
