/// Preloaded into a program: its FAIL_FROM-th call (from 1) that makes a thread or a copy of the process fails, and all
/// after it, as where a limit of processes is reached. 0 or unset: none.
#include <dlfcn.h>
#include <pthread.h>
#include <unistd.h>

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
pid_t fork() noexcept {
    if (!fails()) return own<decltype(fork)>("fork")();
    errno = EAGAIN;
    return -1;
}
}
