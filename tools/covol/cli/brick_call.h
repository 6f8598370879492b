#pragma once
#include <CLI/CLI.hpp>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "cli/output/json.h"

namespace covol::tool {

/// `covol brick plan segment ... -o FOLDER`, `covol brick run FOLDER [BRICK...] [--sweep N]` and `covol brick join
/// FOLDER -o OUT.vdb ...`: the step that is requested, with its arguments.
struct BrickCall {
    enum class Step { Plan, Run, Join } step = Step::Plan;
    std::string folder;
    std::vector<std::size_t> bricks;  ///< bricks to solve, for run; empty: all
    int sweep = 0;                    ///< number of the sweep, for run; 0: sweep 1 if bricks are given, else all sweeps
};

/// Removes the arguments of `brick` from `words`, the arguments after the program's name. The remaining ones are the
/// command line of segment or reconstruct; for run and join, the settings and inputs of the plan are added.
/// @param program  defines the commands whose options a plan may name
/// @return nullopt, with `words` unchanged, unless they begin with `brick` and the name of a step.
/// @throws UsageError, Error InvalidInput, Unsupported (the plan contains more than settings and inputs), Io.
[[nodiscard]] std::optional<BrickCall> take_brick_call(std::vector<std::string>& words, const CLI::App& program);

/// The file in a plan's folder that stores the job and the plan.
[[nodiscard]] std::string plan_file(const std::string& folder);
/// The content of plan_file(). @throws Error InvalidInput, Io.
[[nodiscard]] Json read_plan_file(const std::string& folder);

}  // namespace covol::tool
