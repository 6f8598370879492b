#pragma once
#include <string>

#include "covol/error.h"

namespace covol::detail {

/// An action that cannot be done, or a text that is none. @throws Error InvalidInput.
[[noreturn]] inline void refuse(const std::string& why) { throw Error(Errc::InvalidInput, "study: " + why); }

}  // namespace covol::detail
