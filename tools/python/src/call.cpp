#include "call.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace covol::python {
namespace {

constexpr std::chrono::milliseconds kSignalInterval(50);  // interval of checks for signals

struct Event {
    bool is_progress = false;
    bool is_warning = false;
    double fraction = 0;
    std::string text;  ///< the name of a stage, or a line of the log
};

/// Passes events from the working thread to the calling one.
class EventQueue {
public:
    void put(Event event) {
        const std::lock_guard lock(mutex_);
        // Only the latest progress of a stage is kept.
        if (event.is_progress && !events_.empty() && events_.back().is_progress && events_.back().text == event.text)
            events_.back() = std::move(event);
        else
            events_.push_back(std::move(event));
        wake_.notify_one();
    }
    void close() {
        const std::lock_guard lock(mutex_);
        closed_ = true;
        wake_.notify_one();
    }
    /// Waits for events, at most kSignalInterval, and gets all events so far. @return false if no more will follow
    bool wait(std::vector<Event>& events) {
        std::unique_lock lock(mutex_);
        wake_.wait_for(lock, kSignalInterval, [&] { return closed_ || !events_.empty(); });
        events = std::exchange(events_, {});
        return !closed_;
    }

private:
    std::mutex mutex_;
    std::condition_variable wake_;
    std::vector<Event> events_;
    bool closed_ = false;
};

void deliver(const Call& call, const std::vector<Event>& events) {
    for (const Event& event : events) {
        if (event.is_progress)
            call.progress(event.text, event.fraction);
        else
            call.log(event.is_warning, event.text);
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

}  // namespace

void Call::run(const std::function<void(const RunContext&)>& work) const {
    EventQueue mailbox;
    std::atomic<bool> cancel = false;
    RunContext context;
    context.threads = threads;
    context.memory_budget = memory_limit;
    context.cancel = &cancel;
    if (!progress.is_none())
        context.progress = [&](const std::string& stage, double fraction) {
            mailbox.put({true, false, fraction, stage});
        };
    if (!log.is_none())
        context.log = [&](LogLevel level, const std::string& line) {
            mailbox.put({false, level == LogLevel::Warning, 0, line});
        };

    std::exception_ptr failed, raised;  // exceptions of the work, and of Python callbacks
    {
        const py::gil_scoped_release released;
        std::thread worker([&] {
            try {
                work(context);
            } catch (...) {
                failed = std::current_exception();
            }
            mailbox.close();
        });
        std::vector<Event> events;
        for (bool more = true; more;) {
            more = mailbox.wait(events);
            if (raised) continue;
            const py::gil_scoped_acquire held;
            try {
                deliver(*this, events);
            } catch (...) {
                raised = std::current_exception();
                cancel = true;
            }
        }
        worker.join();
    }
    if (raised) std::rethrow_exception(raised);
    if (failed) std::rethrow_exception(failed);
}

}  // namespace covol::python
