#pragma once
#include <string>

#include "covol/error.h"

namespace covol::detail {

/// Reports an action that cannot be applied, or an invalid text. @throws Error InvalidInput.
[[noreturn]] inline void refuse(const std::string& why) { throw Error(Errc::InvalidInput, "study: " + why); }

}  // namespace covol::detail
