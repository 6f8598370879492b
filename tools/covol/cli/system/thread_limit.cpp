#include "cli/system/thread_limit.h"

#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <future>
#include <new>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "cli/session.h"
#include "covol/file_set.h"

namespace covol::tool {
namespace {

/// How many threads, up to `wanted`, the system can create in addition to the existing ones.
int count_possible(int wanted) {
    std::promise<void> all_there;
    const std::shared_future<void> end(all_there.get_future());
    std::vector<std::thread> threads;
    threads.reserve(std::size_t(std::max(0, wanted)));
    try {
        while (int(threads.size()) < wanted) threads.emplace_back([end] { end.wait(); });
    } catch (const std::system_error&) {
        // The system allows no more threads.
    }
    all_there.set_value();
    for (std::thread& thread : threads) thread.join();
    return int(threads.size());
}

std::atomic<bool> may_have_files = false;

[[noreturn]] void end_at_once(const char* why, int code) {
    for (const char* part : {"covol: error: ", why, "\n"})
        static_cast<void>(!::write(STDERR_FILENO, part, std::strlen(part)));
    if (may_have_files) ScratchFolder::remove_all();
    ::_exit(code);
}

/// Reports a lack of threads or memory if nothing catches the exception, as in TBB and in libraries that create threads
/// when they are loaded.
[[noreturn]] void on_terminate() {
    try {
        if (const std::exception_ptr thrown = std::current_exception()) std::rethrow_exception(thrown);
    } catch (const std::bad_alloc&) {
        end_at_once(kOutOfMemory, kBadInput);
    } catch (const std::exception& error) {
        if (is_missing_thread(error)) end_at_once(kNoThread, kIo);
        for (const char* part : {"covol: error: internal error: ", error.what(), "\n"})
            static_cast<void>(!::write(STDERR_FILENO, part, std::strlen(part)));
    } catch (...) {
        // abort() prints a message.
    }
    std::abort();
}

void before_libraries(int, char**, char**) { std::set_terminate(on_terminate); }

// Run by the loader before any code of a library: log4cplus, a dependency of OpenVDB, creates threads when it is
// loaded.
[[gnu::used, gnu::section(".preinit_array")]] void (*const early)(int, char**, char**) = before_libraries;

}  // namespace

ThreadCount limit_threads(int threads) {
    const auto maximum = int(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
    ThreadCount count;
    count.wanted = threads > 0 ? std::min(threads, maximum) : maximum;
    // The calling thread is one of TBB's threads, so TBB creates one thread fewer than this test. The remaining one is
    // for the child process in which a reader tests files; the limits count processes, too.
    count.possible = std::max(1, count_possible(count.wanted));
    // This object is never destroyed: its limit would end with it, and TBB would create more threads.
    if (count.possible < count.wanted)
        static_cast<void>(
            new tbb::global_control(tbb::global_control::max_allowed_parallelism, std::size_t(count.possible)));
    return count;
}

bool is_missing_thread(const std::exception& error) {
    if (const auto* system = dynamic_cast<const std::system_error*>(&error))
        return system->code() == std::errc::resource_unavailable_try_again;
    return std::string(error.what()).starts_with("pthread_create has failed");  // text of an exception of TBB
}

void expect_temporary_files() { may_have_files = true; }

}  // namespace covol::tool
