/// Preloaded into a program: its FAIL_FROM-th call (from 1) that creates a thread or a process fails, and so do all
/// later ones, as if a limit of processes were reached. 0 or unset: none.
#include <dlfcn.h>
#include <pthread.h>
#include <spawn.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>

namespace {

bool fails() {
    static const long first = std::getenv("FAIL_FROM") == nullptr ? 0 : std::atol(std::getenv("FAIL_FROM"));
    static std::atomic<long> calls{0};
    return ++calls >= first && first > 0;
}

template <class Function>
Function* own(const char* name) {
    return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {
int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*start)(void*),
                   void* argument) noexcept {
    return fails() ? EAGAIN : own<decltype(pthread_create)>("pthread_create")(thread, attributes, start, argument);
}
int posix_spawn(pid_t* process, const char* path, const posix_spawn_file_actions_t* files,
                const posix_spawnattr_t* attributes, char* const* arguments, char* const* environment) noexcept {
    return fails()
               ? EAGAIN
               : own<decltype(posix_spawn)>("posix_spawn")(process, path, files, attributes, arguments, environment);
}
}
