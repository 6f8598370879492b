#include "files/folder_lock.h"

#include <sys/file.h>
#include <sys/sysmacros.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <thread>

#include "base/text.h"
#include "covol/error.h"

namespace covol::detail {
namespace fs = std::filesystem;
namespace {

using Clock = std::chrono::steady_clock;

/// The process that holds a lock, as "process 712 (rsync)", from the system's list of locks; "another program" if it is
/// not in this list.
std::string holder_of(const FileId& file) {
    char place[64];
    std::snprintf(place, sizeof place, " %02x:%02x:%ju ", ::major(file.device), ::minor(file.device),
                  std::uintmax_t(file.inode));
    std::ifstream locks("/proc/locks");
    for (std::string line; std::getline(locks, line);) {
        char kind[16] = {};
        long process = 0;
        // "1: FLOCK  ADVISORY  WRITE 712 fe:01:1234 0 EOF"; "->" marks waiting processes
        if (line.find(place) == std::string::npos ||
            std::sscanf(line.c_str(), "%*d: %15s %*s %*s %ld", kind, &process) != 2 ||
            std::strcmp(kind, "FLOCK") != 0 || process <= 0)
            continue;
        std::string name;
        std::getline(std::ifstream("/proc/" + std::to_string(process) + "/comm"), name);
        return "process " + std::to_string(process) + (name.empty() ? "" : " (" + quote(name) + ")");
    }
    return "another program";
}

}  // namespace

FolderLock::FolderLock(const fs::path& folder, const RunContext& run, std::chrono::milliseconds patience)
    : file_(folder, O_RDONLY | O_DIRECTORY) {
    if (file_.get() < 0) throw Error(Errc::Io, folder.string() + ": cannot write: " + std::strerror(errno));
    constexpr std::chrono::milliseconds kPause{20}, kUntilReported{1000};
    const Clock::time_point begin = Clock::now();
    bool reported = false;
    while (::flock(file_.get(), LOCK_EX | LOCK_NB) != 0) {
        if (errno != EWOULDBLOCK && errno != EINTR) return;
        run.check();
        const auto waited = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - begin);
        if (waited >= patience)
            throw Error(Errc::Io, folder.string() + ": cannot write: waited " +
                                      std::to_string((waited.count() + 500) / 1000) + " s for " + holder_of(id()) +
                                      ", which holds a lock (flock) on this folder; end that program, or choose "
                                      "another folder");
        if (waited >= kUntilReported && !reported) {
            run.info(folder.string() + ": waiting for " + holder_of(id()) +
                     ", which holds a lock (flock) on this folder");
            reported = true;
        }
        std::this_thread::sleep_for(std::min(kPause, patience));
    }
    locked_ = true;
}

}  // namespace covol::detail
