#include "io/child.h"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>
#include <stdexcept>

using covol::Errc;
using covol::Error;
using covol::detail::Trial;
using covol::detail::try_in_child;
using covol::detail::try_reading;

TEST_CASE("Work in a copy of the process leaves this one alone") {
    int here = 1;
    CHECK_FALSE(try_in_child([&] { here = 2; }, 10).crashed);
    CHECK(here == 1);
    const Trial other = try_in_child([] { throw std::runtime_error("no crash"); }, 10);
    CHECK_FALSE(other.crashed);
    CHECK_FALSE(other.refused);
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
