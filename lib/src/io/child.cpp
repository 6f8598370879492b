#include "io/child.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <ctime>
#include <new>
#include <utility>

namespace covol::detail {
namespace {

enum State : std::uint32_t { kWaiting, kBegun, kDone, kRefused, kOther, kCrashed };

/// What copy and parent know of a piece of work; zeros are one that waits.
struct Slot {
    std::uint32_t state;
    std::int32_t code;
    char text[4096];

    [[nodiscard]] State now() { return State(std::atomic_ref(state).load(std::memory_order_acquire)); }
    void set(State next) { std::atomic_ref(state).store(next, std::memory_order_release); }
    [[nodiscard]] bool ended() { return now() > kBegun; }
};

/// Pieces [begin, end) of the work.
struct Batch {
    const std::function<void(std::size_t)>& work;
    Slot* slots;
    std::size_t begin, end;

    [[nodiscard]] std::size_t first_not_ended() const {
        std::size_t n = begin;
        while (n < end && slots[n].ended()) ++n;
        return n;
    }
};

[[noreturn]] void be_child(const Batch& batch) {
    for (const int crash : {SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSEGV}) std::signal(crash, SIG_DFL);
    for (const int stop : {SIGINT, SIGTERM, SIGHUP}) std::signal(stop, SIG_IGN);  // the parent's: not a crash
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const rlimit none{0, 0};
    setrlimit(RLIMIT_CORE, &none);
    if (const int null = open("/dev/null", O_RDWR); null >= 0)
        for (int standard = 0; standard < 3; ++standard) dup2(null, standard);
    for (std::size_t n = batch.begin; n < batch.end; ++n) {
        Slot& slot = batch.slots[n];
        slot.set(kBegun);
        try {
            batch.work(n);
            slot.set(kDone);
        } catch (const Error& error) {
            slot.code = static_cast<std::int32_t>(error.code());
            std::strncpy(slot.text, error.what(), sizeof slot.text - 1);
            slot.set(kRefused);
        } catch (...) {
            slot.set(kOther);
        }
    }
    _exit(0);  // no destructor, no flush: all of that is the parent's
}

/// Seconds that the process has computed; 0 where the system does not say.
double computed_by(pid_t process) {
    clockid_t clock = 0;
    timespec time{};
    if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
    return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

/// Until the copy ends; one that takes too long for a piece, or whose run is cancelled, is killed.
/// @param pipe  hung up when it ends
void wait_for(pid_t child, int pipe, const Batch& batch, double seconds, const RunContext& run) {
    using Clock = std::chrono::steady_clock;
    constexpr int kLongestPause = 20;   // milliseconds: an end of the pipe may be in another copy, too
    constexpr double kMostPauses = 10;  // of a copy that computes nothing: a slow disk, or a lock for ever
    std::size_t piece = batch.begin;
    Clock::time_point since = Clock::now();
    double computed_before = 0;
    while (!run.cancelled()) {
        const pid_t ended = waitpid(child, nullptr, WNOHANG);
        if (ended == child || (ended < 0 && errno != EINTR)) return;
        const double computed = computed_by(child);
        if (const std::size_t now_at = batch.first_not_ended(); now_at != piece) {
            piece = now_at;
            since = Clock::now();
            computed_before = computed;
        }
        if (computed - computed_before > seconds) break;
        if (std::chrono::duration<double>(Clock::now() - since).count() > kMostPauses * seconds) break;
        pollfd hung_up{pipe, 0, 0};
        if (poll(&hung_up, 1, kLongestPause) > 0) usleep(100);  // it is about to end
    }
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
}

/// Does the batch in a copy. @returns the first piece whose end is not known when that has ended
std::size_t run_copy(const Batch& batch, double seconds, const RunContext& run) {
    int ends[2];
    const pid_t child = pipe2(ends, O_CLOEXEC) == 0 ? fork() : -2;
    if (child == 0) be_child(batch);
    if (child != -2) close(ends[1]);
    if (child > 0) wait_for(child, ends[0], batch, seconds, run);
    if (child != -2) close(ends[0]);
    if (child < 0) {
        for (std::size_t n = batch.begin; n < batch.end; ++n) batch.slots[n].set(kOther);
    } else if (const std::size_t n = batch.first_not_ended(); n < batch.end && !run.cancelled()) {
        batch.slots[n].set(kCrashed);
    }
    return batch.first_not_ended();
}

}  // namespace

SharedMemory::SharedMemory(std::uint64_t bytes) : bytes_(std::max<std::uint64_t>(bytes, 1)) {
    void* const place = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (place == MAP_FAILED) throw std::bad_alloc();
    data_ = static_cast<char*>(place);
}

SharedMemory::SharedMemory(SharedMemory&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)), bytes_(other.bytes_) {}

SharedMemory::~SharedMemory() {
    if (data_ != nullptr) munmap(data_, bytes_);
}

std::vector<Trial> try_in_children(std::size_t count, const std::function<void(std::size_t)>& work, double seconds,
                                   const RunContext& run) {
    const SharedMemory memory(count * sizeof(Slot));
    auto* const slots = reinterpret_cast<Slot*>(memory.data());
    const auto do_pieces = [&](std::size_t begin, std::size_t end) {
        for (Batch batch{work, slots, begin, end}; batch.begin < batch.end && !run.cancelled();)
            batch.begin = run_copy(batch, seconds, run);
    };
    // A copy costs milliseconds; a few batches for each thread keep all busy.
    constexpr std::size_t kMostOfCopy = 16, kBatchesOfThread = 4;
    const auto threads = std::size_t(tbb::this_task_arena::max_concurrency());
    const std::size_t pieces = std::clamp<std::size_t>(count / (kBatchesOfThread * threads), 1, kMostOfCopy);
    if (count == 1)
        do_pieces(0, 1);  // by this thread: it may hold locks
    else
        tbb::parallel_for(std::size_t(0), (count + pieces - 1) / pieces,
                          [&](std::size_t b) { do_pieces(b * pieces, std::min((b + 1) * pieces, count)); });
    run.check();
    std::vector<Trial> trials(count);
    for (std::size_t n = 0; n < count; ++n) {
        const State state = slots[n].now();
        trials[n].crashed = state == kCrashed;
        if (state == kRefused) trials[n].refused = Error(static_cast<Errc>(slots[n].code), slots[n].text);
        if (state == kOther) work(n);
    }
    return trials;
}

Trial try_in_child(const std::function<void()>& work, double seconds) {
    return try_in_children(
               1, [&](std::size_t) { work(); }, seconds, RunContext())
        .front();
}

double most_seconds_for_pixels(std::uint64_t bytes) {
    constexpr double kSecondsOfByte = 1e-6;
    return kMostSecondsForHeader + kSecondsOfByte * double(bytes);
}

std::optional<Error> reading_error(const Trial& trial, const std::string& path, const char* library) {
    if (!trial.crashed) return trial.refused;
    return Error(Errc::InvalidInput, "read_image: " + path + ": damaged: the " + library + " library cannot read it");
}

void try_reading(const std::string& path, const char* library, const std::function<void()>& read) {
    if (const auto error = reading_error(try_in_child(read, kMostSecondsForHeader), path, library)) throw Error(*error);
}

}  // namespace covol::detail
