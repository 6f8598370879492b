#pragma once
#include <string>
#include <vector>

#include "cli/session.h"

namespace covol::tool {

/// Time and memory of a run from its report: a table of stages, then the solver's work. Nested stages (coarse levels)
/// are included in the stage that they belong to.
[[nodiscard]] std::vector<std::string> profile_lines(const Json& report);

}  // namespace covol::tool
