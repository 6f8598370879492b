#include "cli/thread_limit.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <future>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "cli/session.h"
#include "covol/file_set.h"

namespace covol::tool {
namespace {

/// How many of so many threads can be there at once beside those that are.
int count_possible(int wanted) {
    std::promise<void> all_there;
    const std::shared_future<void> end = all_there.get_future().share();
    std::vector<std::thread> threads;
    threads.reserve(std::size_t(std::max(0, wanted)));
    try {
        while (int(threads.size()) < wanted) threads.emplace_back([end] { end.wait(); });
    } catch (const std::system_error&) {
        // so many it is
    }
    all_there.set_value();
    for (std::thread& thread : threads) thread.join();
    return int(threads.size());
}

std::terminate_handler handler_before = nullptr;

[[noreturn]] void on_terminate() {
    try {
        if (const std::exception_ptr thrown = std::current_exception()) std::rethrow_exception(thrown);
    } catch (const std::system_error& error) {
        if (error.code() == std::errc::resource_unavailable_try_again) {
            const std::string text = std::string("covol: error: ") + kNoThread + "\n";
            static_cast<void>(!::write(STDERR_FILENO, text.data(), text.size()));
            ScratchFolder::remove_all();
            ::_exit(kIo);
        }
    } catch (...) {
        // a defect
    }
    if (handler_before != nullptr) handler_before();
    std::abort();
}

}  // namespace

ThreadLimit::ThreadLimit(int threads) {
    const auto most = int(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
    wanted_ = threads > 0 ? std::min(threads, most) : most;
    // One more than TBB makes: a reader tries files in a copy of the process.
    possible_ = std::max(1, count_possible(wanted_));
    if (possible_ < wanted_)
        control_ = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                         std::size_t(possible_));
}

ThreadLimit::~ThreadLimit() = default;

void tell_of_missing_threads() { handler_before = std::set_terminate(on_terminate); }

}  // namespace covol::tool
