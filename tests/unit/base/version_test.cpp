#include "covol/version.h"

#include <catch2/catch.hpp>
#include <string>

TEST_CASE("the version as text is its three numbers") {
    CHECK(covol::version() == std::string(COVOL_VERSION_STRING));
    CHECK(covol::version() == std::to_string(COVOL_VERSION_MAJOR) + "." + std::to_string(COVOL_VERSION_MINOR) + "." +
                                  std::to_string(COVOL_VERSION_PATCH));
    CHECK(COVOL_VERSION_NUMBER / 10000 == COVOL_VERSION_MAJOR);
}
