#include "io/child.h"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <stdexcept>

using covol::detail::Trial;
using covol::detail::try_in_child;

TEST_CASE("Work in a copy of the process leaves this one alone") {
    int here = 1;
    CHECK(try_in_child([&] { here = 2; }, 10) == Trial::Ended);
    CHECK(here == 1);
    CHECK(try_in_child([] { throw std::runtime_error("no crash"); }, 10) == Trial::Ended);
}

TEST_CASE("Work that crashes, leaves or hangs in a copy of the process is told of") {
    CHECK(try_in_child([] { raise(SIGSEGV); }, 10) == Trial::Crashed);
    CHECK(try_in_child([] { _exit(3); }, 10) == Trial::Crashed);
    CHECK(try_in_child([] { pause(); }, 0.05) == Trial::Crashed);
}
