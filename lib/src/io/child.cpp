#include "io/child.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <new>
#include <utility>

namespace covol::detail {
namespace {

/// File descriptors in the started program: the shared memory with the Orders (the pieces to process), the shared
/// memory for the results, the writing end of a pipe that is closed when the program ends, and the first descriptor
/// that the program does not inherit.
constexpr int kOrders = 3, kResults = 4, kAlive = 5, kFirstOther = 6;
// Signals that stop programs. The started program ignores them, because wait_for() stops it.
constexpr std::array kStopSignals{SIGINT, SIGTERM, SIGHUP};

enum State : std::uint32_t { kWaiting, kBegun, kDone, kRefused, kNoMemory, kCrashed };

/// State and answer of a Piece (a file to read), shared by both processes. In new memory, which is zero, each piece has
/// the state kWaiting.
struct Slot {
    std::uint32_t state;
    std::int32_t code;
    char text[4096];
    char answer[kAnswerBytes];

    [[nodiscard]] State now() { return State(std::atomic_ref(state).load(std::memory_order_acquire)); }
    void set(State next) { std::atomic_ref(state).store(next, std::memory_order_release); }
    [[nodiscard]] bool ended() { return now() > kBegun; }
    void refuse(Errc why, const char* what) {
        code = static_cast<std::int32_t>(why);
        std::strncpy(text, what, sizeof text - 1);
        set(kRefused);
    }
    /// The error that refuse() has recorded. A malicious file may have made the started program write any data: an
    /// invalid `code` becomes InvalidInput, and `text` may lack its terminating zero.
    [[nodiscard]] Error refusal() const {
        const bool known = code >= 0 && code <= static_cast<std::int32_t>(Errc::Cancelled);
        return {known ? static_cast<Errc>(code) : Errc::InvalidInput, std::string(text, strnlen(text, sizeof text))};
    }
};

/// Layout of the shared memory of Orders, which describes the pieces that the started program processes: this header, a
/// Place for each piece, a Slot for each piece, and the texts of the pieces.
struct Head {
    std::uint64_t count;
    std::uint32_t task;
    std::int32_t parent;
};
struct Place {
    std::uint64_t path, path_end, detail_end;  ///< begin and end of the path, and end of the detail, in the texts
    std::uint64_t begin, bytes;                ///< position and size in bytes of the result, in the memory for results
};

class Orders {
public:
    Orders(std::uint32_t task, const std::vector<Piece>& pieces) : memory_(bytes_for(pieces)) {
        new (memory_.data()) Head{pieces.size(), task, getpid()};
        std::uint64_t at = 0;
        for (std::size_t n = 0; n < pieces.size(); ++n) {
            const Piece& piece = pieces[n];
            const std::uint64_t path_end = at + piece.path.size(), detail_end = path_end + piece.detail.size();
            places()[n] = {at, path_end, detail_end, piece.begin, piece.bytes};
            piece.path.copy(texts() + at, piece.path.size());
            piece.detail.copy(texts() + path_end, piece.detail.size());
            at = detail_end;
        }
    }
    explicit Orders(SharedMemory memory) : memory_(std::move(memory)) {}

    [[nodiscard]] const SharedMemory& memory() const { return memory_; }
    [[nodiscard]] const Head& head() const { return *reinterpret_cast<const Head*>(memory_.data()); }
    [[nodiscard]] Place* places() const { return reinterpret_cast<Place*>(memory_.data() + sizeof(Head)); }
    [[nodiscard]] Slot* slots() const { return reinterpret_cast<Slot*>(places() + head().count); }
    [[nodiscard]] char* texts() const { return reinterpret_cast<char*>(slots() + head().count); }

private:
    static std::uint64_t bytes_for(const std::vector<Piece>& pieces) {
        std::uint64_t bytes = sizeof(Head) + pieces.size() * (sizeof(Place) + sizeof(Slot));
        for (const Piece& piece : pieces) bytes += piece.path.size() + piece.detail.size();
        return bytes;
    }

    SharedMemory memory_;
};

/// The pieces (files to read) with the indices [begin, end), which one process works on.
struct Batch {
    Slot* slots;
    std::size_t begin, end;

    [[nodiscard]] std::size_t first_not_ended() const {
        std::size_t n = begin;
        while (n < end && slots[n].ended()) ++n;
        return n;
    }
};

/// Moves a file descriptor to a number from kFirstOther on, so that the dup2() calls of SpawnPlan do not overwrite it.
/// @returns the number
int above_inherited(int descriptor) {
    const int other = descriptor < 0 ? -1 : fcntl(descriptor, F_DUPFD_CLOEXEC, kFirstOther);
    if (descriptor >= 0) close(descriptor);
    return other;
}

/// A pipe on whose reading end poll() reports a hang-up when all processes that hold its writing end have ended.
struct Pipe {
    Pipe() {
        int ends[2];
        if (pipe2(ends, O_CLOEXEC) != 0)
            throw Error(Errc::Io, std::string("no pipe to covol's reader process could be created: ") +
                                      std::strerror(errno) + "; allow more open files (ulimit -n)");
        from = ends[0];
        to = above_inherited(ends[1]);
    }
    Pipe(const Pipe&) = delete;
    Pipe& operator=(const Pipe&) = delete;
    ~Pipe() {
        close(from);
        close_end();
    }
    void close_end() {
        if (to >= 0) close(std::exchange(to, -1));
    }

    int from, to;
};

/// Descriptors and signals that posix_spawn() sets up for the program.
class SpawnPlan {
public:
    SpawnPlan(int orders, int results, int alive) {
        posix_spawn_file_actions_init(&files_);
        posix_spawnattr_init(&attributes_);
        for (int standard = 0; standard < 3; ++standard)
            posix_spawn_file_actions_addopen(&files_, standard, "/dev/null", O_RDWR, 0);
        for (const auto& [from, to] : {std::pair(orders, kOrders), {results, kResults}, {alive, kAlive}})
            posix_spawn_file_actions_adddup2(&files_, from, to);
        posix_spawn_file_actions_addclosefrom_np(&files_, kFirstOther);
        sigset_t all, stops;
        sigfillset(&all);
        sigemptyset(&stops);
        for (const int stop : kStopSignals) sigaddset(&stops, stop);
        posix_spawnattr_setsigdefault(&attributes_, &all);
        posix_spawnattr_setsigmask(&attributes_, &stops);
        posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK);
    }
    SpawnPlan(const SpawnPlan&) = delete;
    SpawnPlan& operator=(const SpawnPlan&) = delete;
    ~SpawnPlan() {
        posix_spawn_file_actions_destroy(&files_);
        posix_spawnattr_destroy(&attributes_);
    }

    /// @returns the process ID; throws Error Io.
    [[nodiscard]] pid_t start(const std::string& program, const Batch& batch) const {
        std::string name = program, begin = std::to_string(batch.begin), end = std::to_string(batch.end);
        std::string locale = "LC_ALL=C", libraries = "LD_LIBRARY_PATH=";
        const char* const folders = std::getenv("LD_LIBRARY_PATH");
        if (folders != nullptr) libraries += folders;
        char* const arguments[] = {name.data(), begin.data(), end.data(), nullptr};
        char* const environment[] = {locale.data(), folders != nullptr ? libraries.data() : nullptr, nullptr};
        pid_t process = 0;
        const int why = posix_spawn(&process, program.c_str(), &files_, &attributes_, arguments, environment);
        if (why != 0)
            throw Error(Errc::Io, program + ": covol's reader, the process that decodes files, could not be started: " +
                                      std::strerror(why) +
                                      (why == EAGAIN || why == ENOMEM ? "; allow more processes, threads or memory"
                                                                      : "; install covol again"));
        return process;
    }

private:
    posix_spawn_file_actions_t files_{};
    posix_spawnattr_t attributes_{};
};

/// CPU time of the process in seconds; 0 if the system does not report it.
double cpu_seconds(pid_t process) {
    clockid_t clock = 0;
    timespec time{};
    if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
    return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

/// Waits until the program ends. Kills the program if it takes too long for a piece (a file to read), or if the run is
/// cancelled.
/// @param pipe  the reading end of a pipe whose writing end is closed when the program ends
/// @param seconds  maximum CPU time for one piece
void wait_for(pid_t child, int pipe, const Batch& batch, double seconds, const RunContext& run) {
    using Clock = std::chrono::steady_clock;
    constexpr int kLongestPause = 20;  // [ms] maximum time between two checks of the limits
    // A piece may take this many times `seconds` of elapsed time, because reading from a slow disk uses no CPU time.
    constexpr double kMaxPauses = 10;
    std::size_t piece = batch.begin;
    Clock::time_point since = Clock::now();
    double computed_before = 0;
    while (!run.cancelled()) {
        const pid_t ended = waitpid(child, nullptr, WNOHANG);
        if (ended == child || (ended < 0 && errno != EINTR)) return;
        const double computed = cpu_seconds(child);
        if (const std::size_t now_at = batch.first_not_ended(); now_at != piece) {
            piece = now_at;
            since = Clock::now();
            computed_before = computed;
        }
        if (computed - computed_before > seconds) break;
        if (std::chrono::duration<double>(Clock::now() - since).count() > kMaxPauses * seconds) break;
        pollfd hung_up{pipe, 0, 0};
        if (poll(&hung_up, 1, kLongestPause) > 0) usleep(100);  // The pipe is closed, so waitpid() will soon succeed.
    }
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
}

/// Runs the program on the batch. @returns the index of the first piece whose outcome is still unknown after the
/// program has ended
std::size_t run_program(const std::string& program, const Orders& orders, const SharedMemory& results,
                        const Batch& batch, double seconds, const RunContext& run) {
    Pipe alive;
    const SpawnPlan plan(orders.memory().descriptor(), results.descriptor(), alive.to);
    const pid_t child = plan.start(program, batch);
    alive.close_end();
    wait_for(child, alive.from, batch, seconds, run);
    const std::size_t n = batch.first_not_ended();
    if (n == batch.end || run.cancelled()) return n;
    // The program has ended before it began this piece, so the file is not the reason. For example, a library may have
    // been unable to start a thread when it was loaded.
    if (batch.slots[n].now() != kBegun)
        throw Error(Errc::Io,
                    program +
                        ": the reader process ended before it could read a file; "
                        "allow more processes, threads or memory, or, if it happens every time, install covol again");
    batch.slots[n].set(kCrashed);
    return n + 1;
}

void do_piece(const std::function<void(const PieceAtWork&)>& work, const Orders& orders, const SharedMemory& results,
              std::size_t n) {
    Slot& slot = orders.slots()[n];
    const Place& place = orders.places()[n];
    const std::string path(orders.texts() + place.path, orders.texts() + place.path_end);
    const std::string detail(orders.texts() + place.path_end, orders.texts() + place.detail_end);
    slot.set(kBegun);
    try {
        work({orders.head().task, path, detail, {results.data() + place.begin, place.bytes}, slot.answer});
        slot.set(kDone);
    } catch (const Error& error) {
        slot.refuse(error.code(), error.what());
    } catch (const std::bad_alloc&) {
        slot.set(kNoMemory);
    } catch (const std::exception& error) {
        slot.refuse(Errc::InvalidInput, (path + ": " + error.what()).c_str());
    }
}

}  // namespace

SharedMemory::SharedMemory(std::uint64_t bytes)
    : SharedMemory(above_inherited(memfd_create("covol", MFD_CLOEXEC | MFD_ALLOW_SEALING)),
                   std::max<std::uint64_t>(bytes, 1)) {}

SharedMemory::SharedMemory(int descriptor, std::uint64_t bytes) : descriptor_(descriptor), bytes_(bytes) {
    // The seals prevent both processes from changing the size of memory that the other process has mapped; accesses
    // beyond a reduced size would crash the other process.
    const bool made = ftruncate(descriptor, off_t(bytes)) == 0 &&
                      fcntl(descriptor, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) == 0;
    const int why = made ? 0 : errno;
    data_ = made ? mapped() : nullptr;
    if (data_ != nullptr) return;
    if (descriptor >= 0) close(descriptor);
    if (why != EFBIG) throw std::bad_alloc();
    throw Error(Errc::Io, "expected " + std::to_string(bytes) +
                              " bytes of memory shared with the reader process, got: " + std::strerror(why) +
                              "; allow larger files (ulimit -f), because this memory counts as a file");
}

SharedMemory::SharedMemory(Given given) : descriptor_(given.descriptor) {
    struct stat status {};
    bytes_ = fstat(descriptor_, &status) == 0 ? std::uint64_t(status.st_size) : 0;
    data_ = bytes_ > 0 ? mapped() : nullptr;
    if (data_ == nullptr) throw std::bad_alloc();
}

char* SharedMemory::mapped() const {
    void* const place = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, 0);
    return place == MAP_FAILED ? nullptr : static_cast<char*>(place);
}

SharedMemory::SharedMemory(SharedMemory&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      bytes_(other.bytes_),
      data_(std::exchange(other.data_, nullptr)) {}

SharedMemory::~SharedMemory() {
    if (data_ != nullptr) munmap(data_, bytes_);
    if (descriptor_ >= 0) close(descriptor_);
}

std::vector<PieceOutcome> run_pieces(const std::string& program, std::uint32_t task, const std::vector<Piece>& pieces,
                                     const SharedMemory& results, double seconds, const RunContext& run) {
    const Orders orders(task, pieces);
    const std::size_t count = pieces.size();
    const auto do_batch = [&](std::size_t begin, std::size_t end) {
        for (Batch batch{orders.slots(), begin, end}; batch.begin < batch.end && !run.cancelled();)
            batch.begin = run_program(program, orders, results, batch, seconds, run);
    };
    // Each process works on a batch, because starting the program and loading its libraries takes tens of milliseconds.
    constexpr std::size_t kMinOfBatch = 8, kMaxOfBatch = 64, kBatchesOfThread = 2;
    const auto threads = std::size_t(tbb::this_task_arena::max_concurrency());
    const std::size_t size = std::clamp(count / (kBatchesOfThread * threads), kMinOfBatch, kMaxOfBatch);
    tbb::parallel_for(std::size_t(0), (count + size - 1) / size,
                      [&](std::size_t b) { do_batch(b * size, std::min((b + 1) * size, count)); });
    run.check();
    std::vector<PieceOutcome> trials(count);
    for (std::size_t n = 0; n < count; ++n) {
        Slot& slot = orders.slots()[n];
        const State state = slot.now();
        if (state == kNoMemory) throw std::bad_alloc();
        if (state == kRefused)
            trials[n].refused = slot.refusal();
        else if (state == kDone)
            trials[n].answer.assign(slot.answer, slot.answer + sizeof slot.answer);
        else
            trials[n].crashed = true;
    }
    return trials;
}

int serve_pieces(int count, char** arguments, const std::function<void(const PieceAtWork&)>& work) {
    struct stat status {};
    if (count != 3 || fstat(kAlive, &status) != 0 || !S_ISFIFO(status.st_mode)) return 2;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (const int stop : kStopSignals) std::signal(stop, SIG_IGN);
    const rlimit none{0, 0};
    setrlimit(RLIMIT_CORE, &none);
    const Orders orders(SharedMemory(SharedMemory::Given{kOrders}));
    const SharedMemory results(SharedMemory::Given{kResults});
    // If the parent has ended before prctl(), the signal for its end will not arrive.
    if (getppid() != orders.head().parent) return 2;
    const std::size_t end = std::strtoull(arguments[2], nullptr, 10);
    for (std::size_t n = std::strtoull(arguments[1], nullptr, 10); n < end; ++n) do_piece(work, orders, results, n);
    _exit(0);  // ends without destructors, because those of a library may crash after it has read a damaged file
}

double max_seconds_for_pixels(std::uint64_t bytes) {
    constexpr double kSecondsOfByte = 1e-6;
    return kMaxSecondsForHeader + kSecondsOfByte * double(bytes);
}

std::optional<Error> reading_error(const PieceOutcome& trial, const std::string& path, const char* library) {
    if (!trial.crashed) return trial.refused;
    return Error(Errc::InvalidInput, path + ": probably damaged: the " + library +
                                         " library crashed or took too long when it read the file");
}

}  // namespace covol::detail
