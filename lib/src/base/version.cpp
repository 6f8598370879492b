#include "covol/version.h"

#include <openvdb/version.h>

#define COVOL_TEXT_OF(x) #x
#define COVOL_TEXT(x) COVOL_TEXT_OF(x)

#if defined(__clang__)
#define COVOL_COMPILER "Clang " COVOL_TEXT(__clang_major__) "." COVOL_TEXT(__clang_minor__)
#elif defined(__GNUC__)
#define COVOL_COMPILER "GCC " COVOL_TEXT(__GNUC__) "." COVOL_TEXT(__GNUC_MINOR__) "." COVOL_TEXT(__GNUC_PATCHLEVEL__)
#else
#define COVOL_COMPILER "another compiler"
#endif

#if defined(__x86_64__)
#define COVOL_MACHINE "x86_64"
#elif defined(__aarch64__)
#define COVOL_MACHINE "aarch64"
#else
#define COVOL_MACHINE "another processor"
#endif

#ifdef NDEBUG
#define COVOL_CHECKS ""
#else
#define COVOL_CHECKS ", with assertions"
#endif

#ifdef COVOL_REVISION
#define COVOL_SOURCE ", revision " COVOL_REVISION
#else
#define COVOL_SOURCE ""
#endif

namespace covol {

const char* version() noexcept { return COVOL_VERSION_STRING; }

const char* build_text() noexcept {
    return COVOL_COMPILER ", " COVOL_MACHINE ", OpenVDB " OPENVDB_LIBRARY_VERSION_STRING COVOL_CHECKS COVOL_SOURCE;
}

}  // namespace covol
