#pragma once

#include "covol/api.h"

// CMake compares these with the project's version.
#define COVOL_VERSION_MAJOR 0
#define COVOL_VERSION_MINOR 1
#define COVOL_VERSION_PATCH 0
#define COVOL_VERSION_STRING "0.1.0"
/// The version as one number, for comparisons with #if: 100 for 0.1.0, 10203 for 1.2.3.
#define COVOL_VERSION_NUMBER (COVOL_VERSION_MAJOR * 10000 + COVOL_VERSION_MINOR * 100 + COVOL_VERSION_PATCH)

namespace covol {

/// The version of the library in use at run time; the macros give the version at compile time.
[[nodiscard]] COVOL_API const char* version() noexcept;

/// How the library was built: "GCC 12.2.0, x86_64, OpenVDB 10.0.1", and the revision of its source if the CMake
/// variable COVOL_REVISION was set.
[[nodiscard]] COVOL_API const char* build_text() noexcept;

}  // namespace covol
