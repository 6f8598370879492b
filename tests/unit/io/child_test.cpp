#include "io/child.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <new>
#include <thread>
#include <vector>

using namespace covol;
using namespace covol::detail;

namespace {

constexpr std::uint32_t kTask = 7;

PieceOutcome try_one(const Piece& piece, double seconds = 10, const SharedMemory& results = SharedMemory(0)) {
    return run_pieces(COVOL_ODD_READER, kTask, {piece}, results, seconds, RunContext()).front();
}

std::size_t open_descriptors() {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd"))
        count += entry.path().empty() ? 0 : 1;
    return count;
}

}  // namespace

TEST_CASE("Child process: its result is in the shared memory, and no file descriptor stays open") {
    const std::size_t before = open_descriptors();
    {
        const SharedMemory results(16);
        const PieceOutcome trial = try_one({"write", "", 8, 4}, 10, results);
        CHECK_FALSE(trial.crashed);
        CHECK_FALSE(trial.refused);
        std::uint32_t written = 0, neighbour = 0;
        std::memcpy(&written, results.data() + 8, sizeof written);
        std::memcpy(&neighbour, results.data() + 4, sizeof neighbour);
        CHECK(written == kTask);
        CHECK(neighbour == 0);
        CHECK(ftruncate(results.descriptor(), 1) != 0);  // nobody may shrink the shared memory, not even the program
    }
    CHECK(open_descriptors() == before);
}

TEST_CASE("Pieces of work: each is done, and crashes and errors are reported per piece, with 1 and 8 threads") {
    constexpr std::size_t kCount = 100;
    std::vector<Piece> pieces;
    for (std::size_t n = 0; n < kCount; ++n)
        pieces.push_back({n % 50 == 7   ? "abort"
                          : n % 50 == 9 ? "refuse"
                                        : "write",
                          "piece " + std::to_string(n), 4 * n, 4});
    for (const int threads : {1, 8}) {
        const SharedMemory results(4 * kCount);
        const auto* const values = reinterpret_cast<const std::uint32_t*>(results.data());
        std::vector<PieceOutcome> trials;
        RunContext run;
        run.threads = threads;
        with_threads(run, [&] { trials = run_pieces(COVOL_ODD_READER, kTask, pieces, results, 10, run); });
        REQUIRE(trials.size() == kCount);
        for (std::size_t n = 0; n < kCount; ++n) {
            CHECK(trials[n].crashed == (n % 50 == 7));
            CHECK(trials[n].refused.has_value() == (n % 50 == 9));
            if (trials[n].refused) CHECK(trials[n].refused->what() == "piece " + std::to_string(n));
            CHECK(values[n] == (n % 50 == 7 || n % 50 == 9 ? 0 : kTask));
        }
    }
    CHECK(run_pieces(COVOL_ODD_READER, kTask, {}, SharedMemory(0), 10, RunContext()).empty());
}

TEST_CASE("A hanging piece of work does not affect the others, and a cancelled run does not wait for it") {
    const std::vector<Piece> pieces{{"write"}, {"hang"}, {"write"}};
    const std::vector<PieceOutcome> trials =
        run_pieces(COVOL_ODD_READER, kTask, pieces, SharedMemory(0), 0.2, RunContext());
    CHECK_FALSE(trials[0].crashed);
    CHECK(trials[1].crashed);
    CHECK_FALSE(trials[2].crashed);

    std::atomic<bool> cancel = false;
    RunContext run;
    run.cancel = &cancel;
    std::thread later([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        cancel = true;
    });
    try {
        run_pieces(COVOL_ODD_READER, kTask, pieces, SharedMemory(0), 1000, run);
        FAIL("not cancelled");
    } catch (const Error& error) {
        CHECK(error.code() == Errc::Cancelled);
    }
    later.join();
}

TEST_CASE("An error in the child process is reported with its code and message") {
    const PieceOutcome trial = try_one({"refuse", "a.h5: sheared"});
    CHECK_FALSE(trial.crashed);
    REQUIRE(trial.refused);
    CHECK(trial.refused->code() == Errc::Unsupported);
    CHECK(std::string(trial.refused->what()) == "a.h5: sheared");

    const PieceOutcome cut = try_one({"refuse", std::string(1 << 20, 'x')});
    REQUIRE(cut.refused);
    CHECK(std::string(cut.refused->what()) == std::string(4095, 'x'));

    const PieceOutcome other = try_one({"fail"});
    REQUIRE(other.refused);
    CHECK(std::string(other.refused->what()) == "fail: a failure");
    CHECK_THROWS_AS(try_one({"no memory"}), std::bad_alloc);
}

TEST_CASE("A child process that crashes, exits or exceeds its time is reported as crashed") {
    CHECK(try_one({"segv"}).crashed);
    CHECK(try_one({"leave"}).crashed);
    CHECK(try_one({"hang"}, 0.2).crashed);
    CHECK(try_one({"compute"}, 0.2).crashed);
}

TEST_CASE("A child process inherits no environment variables, and no open files except standard streams") {
    setenv("COVOL_TEST_VARIABLE", "1", 1);
    CHECK(std::string(try_one({"variable", "COVOL_TEST_VARIABLE"}).answer.data()).empty());
    CHECK(std::string(try_one({"variable", "LC_ALL"}).answer.data()) == "set");
    const int open = dup(1);
    REQUIRE(open >= 0);
    CHECK(std::string(try_one({"open", "1"}).answer.data()) == "open");
    CHECK(std::string(try_one({"open", std::to_string(std::max(open, 6))}).answer.data()).empty());
    close(open);
}

TEST_CASE("A missing program is an I/O error with its path") {
    try {
        run_pieces("/none/covol-reader", kTask, {{"write"}}, SharedMemory(0), 10, RunContext());
        FAIL("started");
    } catch (const Error& error) {
        CHECK(error.code() == Errc::Io);
        CHECK(std::string(error.what()).find("/none/covol-reader") != std::string::npos);
    }
}

TEST_CASE("A file that crashes the reading library is reported as damaged") {
    CHECK_FALSE(reading_error(try_one({"write"}), "a.dcm", "GDCM"));
    const auto error = reading_error(try_one({"abort"}), "a.dcm", "GDCM");
    REQUIRE(error);
    CHECK(error->code() == Errc::InvalidInput);
    CHECK(std::string(error->what()) ==
          "a.dcm: probably damaged: the GDCM library crashed or took too long when it read the file");
}
