#include "covol/version.h"

#include <openvdb/version.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <string>

TEST_CASE("version(): the text consists of the three version numbers") {
    CHECK(covol::version() == std::string(COVOL_VERSION_STRING));
    CHECK(covol::version() == std::to_string(COVOL_VERSION_MAJOR) + "." + std::to_string(COVOL_VERSION_MINOR) + "." +
                                  std::to_string(COVOL_VERSION_PATCH));
    CHECK(COVOL_VERSION_NUMBER / 10000 == COVOL_VERSION_MAJOR);
}

TEST_CASE("build_text() names the compiler, the processor and the version of OpenVDB") {
    const std::string text = covol::build_text();
    CHECK(text.find(OPENVDB_LIBRARY_VERSION_STRING) != std::string::npos);
    CHECK(std::count(text.begin(), text.end(), ',') >= 2);
    // build_text() contains "another" if it does not know the compiler or the processor. The tests run on x86-64 and
    // aarch64, with GCC and Clang, which it knows.
    CHECK(text.find("another") == std::string::npos);
}
