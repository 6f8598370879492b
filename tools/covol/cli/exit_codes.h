#pragma once
#include "covol/error.h"

namespace covol::tool {

/// Exit codes of the program.
enum ExitCode {
    kDone = 0,
    kDefect = 1,
    kUsage = 2,
    kBadInput = 3,
    kIo = 4,
    kWarned = 5,
    kNumerical = 6,
    kInterrupted = 130
};

[[nodiscard]] int exit_code_of(Errc code);

}  // namespace covol::tool
