/// Preloaded into a program, or linked into it: counts, from 1, the calls below, which put files in place. Kills the
/// program before call number KILL_AT, as a power failure or the out-of-memory killer would. 0 or unset: never.
#include <dlfcn.h>
#include <sys/types.h>

#include <atomic>
#include <csignal>
#include <cstdlib>

namespace {

struct Count {
    std::atomic<long> last{std::getenv("KILL_AT") == nullptr ? 0 : std::atol(std::getenv("KILL_AT"))};
    std::atomic<long> calls{0};
};
Count& counted() {
    static Count all;
    return all;
}

void count() {
    if (++counted().calls == counted().last) std::raise(SIGKILL);
}

template <class... Arguments>
int pass_on(const char* name, Arguments... arguments) {
    count();
    return reinterpret_cast<int (*)(Arguments...)>(::dlsym(RTLD_NEXT, name))(arguments...);
}

}  // namespace

extern "C" {
/// Restarts the count, and sets the number of the call before which the program is killed; 0: never.
void covol_kill_before(long number) {
    counted().calls = 0;
    counted().last = number;
}
int fsync(int file) { return pass_on("fsync", file); }
int rename(const char* from, const char* to) noexcept { return pass_on("rename", from, to); }
int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) noexcept {
    return pass_on("renameat2", from_folder, from, to_folder, to, flags);
}
int unlink(const char* path) noexcept { return pass_on("unlink", path); }
int unlinkat(int folder, const char* path, int flags) noexcept { return pass_on("unlinkat", folder, path, flags); }
int remove(const char* path) noexcept { return pass_on("remove", path); }
int mkdir(const char* path, mode_t mode) noexcept { return pass_on("mkdir", path, mode); }
int flock(int file, int operation) noexcept { return pass_on("flock", file, operation); }
}
