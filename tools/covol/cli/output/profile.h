#pragma once
#include <string>
#include <vector>

#include "cli/session.h"

namespace covol::tool {

/// Lines of text with the time and memory of a run, from its report: a table of stages, then the solver's work. The
/// time of a nested stage (a coarse level) is included in the time of the stage that contains it.
[[nodiscard]] std::vector<std::string> profile_lines(const Json& report);

}  // namespace covol::tool
