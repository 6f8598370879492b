#include "io/child.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <thread>
#include <vector>

using namespace covol;
using namespace covol::detail;

TEST_CASE("Work in a copy of the process leaves this one alone") {
    int here = 1;
    CHECK_FALSE(try_in_child([&] { here = 2; }, 10).crashed);
    CHECK(here == 1);
}

TEST_CASE("What throws no covol::Error in a copy of the process is done in this one") {
    int here = 1;
    const auto work = [&] {
        here = 2;
        throw std::runtime_error("no crash");
    };
    CHECK_THROWS_AS(try_in_child(work, 10), std::runtime_error);
    CHECK(here == 2);
}

TEST_CASE("Many pieces of work in copies of the process: each is done, and those that fail are told of") {
    constexpr std::size_t kCount = 200;
    const SharedMemory memory(kCount * sizeof(int));
    auto* const values = reinterpret_cast<int*>(memory.data());
    const auto work = [&](std::size_t n) {
        if (n % 50 == 7) std::abort();
        if (n % 50 == 9) throw Error(Errc::Unsupported, "piece " + std::to_string(n));
        values[n] = int(n) + 1;
    };
    for (const int threads : {1, 2, 8}) {
        std::fill_n(values, kCount, 0);
        std::vector<Trial> trials;
        RunContext run;
        run.threads = threads;
        with_threads(run, [&] { trials = try_in_children(kCount, work, 10, run); });
        REQUIRE(trials.size() == kCount);
        for (std::size_t n = 0; n < kCount; ++n) {
            CHECK(trials[n].crashed == (n % 50 == 7));
            CHECK(trials[n].refused.has_value() == (n % 50 == 9));
            if (trials[n].refused) CHECK(trials[n].refused->what() == "piece " + std::to_string(n));
            CHECK(values[n] == (n % 50 == 7 || n % 50 == 9 ? 0 : int(n) + 1));
        }
    }
    CHECK(try_in_children(0, work, 10, RunContext()).empty());
}

TEST_CASE("A piece that hangs costs its own time alone, and a run that is cancelled does not wait for it") {
    const auto work = [](std::size_t n) {
        if (n == 1) pause();
    };
    const std::vector<Trial> trials = try_in_children(3, work, 0.05, RunContext());
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
        try_in_children(3, work, 1000, run);
        FAIL("not cancelled");
    } catch (const Error& error) {
        CHECK(error.code() == Errc::Cancelled);
    }
    later.join();
}

TEST_CASE("An error in a copy of the process is told of") {
    const Trial trial = try_in_child([] { throw Error(Errc::Unsupported, "read_image: a.h5: sheared"); }, 10);
    CHECK_FALSE(trial.crashed);
    REQUIRE(trial.refused);
    CHECK(trial.refused->code() == Errc::Unsupported);
    CHECK(std::string(trial.refused->what()) == "read_image: a.h5: sheared");

    // Longer than a pipe holds, it neither waits nor is lost.
    const Trial cut = try_in_child([] { throw Error(Errc::Io, std::string(1 << 20, 'x')); }, 10);
    CHECK_FALSE(cut.crashed);
    REQUIRE(cut.refused);
    CHECK(std::string(cut.refused->what()) == std::string(4095, 'x'));
}

TEST_CASE("Work that crashes, leaves or hangs in a copy of the process is told of") {
    CHECK(try_in_child([] { raise(SIGSEGV); }, 10).crashed);
    CHECK(try_in_child([] { _exit(3); }, 10).crashed);
    CHECK(try_in_child([] { pause(); }, 0.05).crashed);
    volatile bool for_ever = true;
    CHECK(try_in_child(
              [&] {
                  while (for_ever) continue;
              },
              0.05)
              .crashed);
}

TEST_CASE("A file that crashes its library is damaged") {
    CHECK_NOTHROW(try_reading("a.dcm", "GDCM", [] {}));
    try {
        try_reading("a.dcm", "GDCM", [] { std::abort(); });
        FAIL("not refused");
    } catch (const Error& error) {
        CHECK(error.code() == Errc::InvalidInput);
        CHECK(std::string(error.what()) == "read_image: a.dcm: damaged: the GDCM library cannot read it");
    }
}
