#pragma once
#include <CLI/CLI.hpp>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "cli/json.h"

namespace covol::tool {

/// `covol brick plan segment ... -o FOLDER`, `covol brick run FOLDER [BRICK...] [--sweep N]` and
/// `covol brick join FOLDER -o OUT.vdb ...`: a job's command line, and what of it is done now.
struct BrickCall {
    enum class Step { Plan, Run, Join } step = Step::Plan;
    std::string folder;
    std::vector<std::size_t> bricks;  ///< of run; empty: all
    int sweep = 0;                    ///< of run; 0: as many as it takes
};

/// Takes what belongs to `brick` off the words behind the program's name; what is left is the command line of a segment
/// or reconstruct, of run and join with the settings and inputs that the plan keeps.
/// @param program  whose commands' options a plan may name
/// @return nothing, and the same words, where they are another command's.
/// @throws UsageError, Error InvalidInput, Unsupported (the plan asks for more than that), Io.
[[nodiscard]] std::optional<BrickCall> take_brick_call(std::vector<std::string>& words, const CLI::App& program);

/// The file in a plan's folder that has the job, and all else.
[[nodiscard]] std::string plan_file(const std::string& folder);
/// What is in it. @throws Error InvalidInput, Io.
[[nodiscard]] Json read_plan_file(const std::string& folder);

}  // namespace covol::tool
