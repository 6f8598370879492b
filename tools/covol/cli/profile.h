#pragma once
#include <string>
#include <vector>

#include "cli/session.h"

namespace covol::tool {

/// Where a run's time and memory went, from its report: a table of stages, then the solver's work. Stages that ran
/// below others (coarse levels) are inside their own line.
[[nodiscard]] std::vector<std::string> profile_lines(const Json& report);

}  // namespace covol::tool
