#include "covol/run.h"

#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <memory>
#include <thread>

#include "base/while_any.h"
#include "covol/error.h"

using namespace covol;

namespace {

int width() { return tbb::this_task_arena::max_concurrency(); }

bool flag = true;
struct FlagOff {
    FlagOff() { flag = false; }
    ~FlagOff() { flag = before; }
    bool before = flag;
};

}  // namespace

TEST_CASE("with_threads limits the concurrency of loops inside it and not outside of it") {
    const int outside = width();
    for (const int threads : {1, 2, 3, 8}) {
        RunContext run;
        run.threads = threads;
        with_threads(run, [&] {
            CHECK(width() == threads);
            std::atomic<int> busy = 0, maximum = 0;
            tbb::parallel_for(0, 1000, [&](int) {
                const int now = ++busy;
                for (int seen = maximum; seen < now && !maximum.compare_exchange_weak(seen, now);) {
                }
                --busy;
            });
            CHECK(maximum <= threads);
        });
        CHECK(width() == outside);
    }
    with_threads({}, [&] { CHECK(width() == outside); });
}

TEST_CASE("with_threads, nested: the requested width applies, on the calling thread") {
    RunContext three, two;
    three.threads = 3;
    two.threads = 2;
    const auto caller = std::this_thread::get_id();
    with_threads(three, [&] {
        with_threads(three, [&] {
            CHECK(width() == 3);
            with_threads({}, [&] { CHECK(width() == 3); });
            with_threads(two, [&] {
                CHECK(width() == 2);
                CHECK(std::this_thread::get_id() == caller);
            });
        });
        CHECK(width() == 3);
    });
}

TEST_CASE("with_threads propagates exceptions, including those of parallel loops and nested calls") {
    RunContext run;
    run.threads = 3;
    const auto code_of = [&](const std::function<void()>& work) {
        try {
            with_threads(run, work);
        } catch (const Error& error) {
            return error.code();
        }
        return Errc::Io;
    };
    CHECK(code_of([] { throw Error(Errc::Cancelled, "cancelled"); }) == Errc::Cancelled);
    CHECK(code_of([] {
              tbb::parallel_for(0, 100, [](int i) {
                  if (i == 50) throw Error(Errc::Numerical, "fifty");
              });
          }) == Errc::Numerical);
    CHECK(code_of([&] { with_threads(run, [] { throw Error(Errc::Unsupported, "inner"); }); }) == Errc::Unsupported);
}

TEST_CASE("WhileAny: a global setting is restored when the last of overlapping scopes ends") {
    auto first = std::make_unique<detail::WhileAny<FlagOff>>();
    auto second = std::make_unique<detail::WhileAny<FlagOff>>();
    CHECK_FALSE(flag);
    first.reset();
    CHECK_FALSE(flag);
    second.reset();
    CHECK(flag);
}
