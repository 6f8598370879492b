#pragma once
// From a start to the final surface. A flow that loses the surface is replaced by the start or by a guess.
#include "segment/solve/flow.h"

namespace covol::pipeline {

/// The flow from `start`, after the requested coarse levels. A surface that vanished, or that left the marks, is not
/// returned if the start or the marks give a better one.
/// @param edge     with the feature that the marks lie on
/// @param reached  receives the grids as they are made, or null
/// @throws Error InvalidInput (the surface vanished); the errors of the single steps.
[[nodiscard]] Solution solve(const Problem& problem, const Choices& choices, StartSurface start,
                             const EdgeOptions& edge, Reached* reached);

}  // namespace covol::pipeline
