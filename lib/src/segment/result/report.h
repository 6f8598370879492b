#pragma once
// What is told of a result: what was used, how well it fits, and what speaks against it.
#include "segment/result/final_surface.h"

namespace covol::pipeline {

/// What was used: each automatic choice that was made has its value.
[[nodiscard]] SegmentOptions resolved_options(const Problem& problem, const Choices& choices, const Solution& solution);

/// @param before  of the steps before the start
[[nodiscard]] SegmentReport measure(const Problem& problem, const Choices& choices, const StepReport& before,
                                    const Solution& solution, const Surface& surface);

}  // namespace covol::pipeline
