#pragma once
#include <CLI/CLI.hpp>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "cli/output/json.h"

namespace covol::tool {

/// `covol brick plan segment ... -o FOLDER`, `covol brick run FOLDER [BRICK...] [--sweep N]` and `covol brick join
/// FOLDER -o OUT.vdb ...`: the command line of a job, and the step of it that is run now.
struct BrickCall {
    enum class Step { Plan, Run, Join } step = Step::Plan;
    std::string folder;
    std::vector<std::size_t> bricks;  ///< for run; empty: all
    int sweep = 0;                    ///< for run; 0: as many as are needed
};

/// Removes the arguments that belong to `brick` from the arguments after the program's name. The remaining ones are the
/// command line of segment or reconstruct; for run and join, the settings and inputs that the plan stores are added.
/// @param program  defines the commands whose options a plan may name
/// @return nullopt, and the arguments unchanged, if they belong to another command.
/// @throws UsageError, Error InvalidInput, Unsupported (the plan contains more than settings and inputs), Io.
[[nodiscard]] std::optional<BrickCall> take_brick_call(std::vector<std::string>& words, const CLI::App& program);

/// The file in a plan's folder that stores the job and the plan.
[[nodiscard]] std::string plan_file(const std::string& folder);
/// Its content. @throws Error InvalidInput, Io.
[[nodiscard]] Json read_plan_file(const std::string& folder);

}  // namespace covol::tool
