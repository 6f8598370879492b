#pragma once
// The report on a result: options used, quality of the fit, and warnings.
#include "segment/result/final_surface.h"

namespace covol::pipeline {

/// The options as used: each automatic choice is replaced by its value.
[[nodiscard]] SegmentOptions resolved_options(const Problem& problem, const Choices& choices, const Solution& solution);

/// @param before  report of the steps that preceded the start of the level set
[[nodiscard]] SegmentReport measure(const Problem& problem, const Choices& choices, const StepReport& before,
                                    const Solution& solution, const Surface& surface);

}  // namespace covol::pipeline
