#pragma once
// Computes the final surface from a start. If the surface vanishes in the flow or leaves the marks, or if a start that
// was grown to the image's edges loses more than half of its volume, the result is that start itself, or the result of
// another flow from the start or from the guess.
#include "segment/solve/flow.h"

namespace covol::pipeline {

/// The flow from `start`, after the requested coarse levels. A surface that vanished, or that left the marks, is not
/// returned if the start or the marks give a better one.
/// @param edge     options of the edge detector, with the feature on which the marks lie
/// @param reached  receives the grids as they are made, or null
/// @throws Error InvalidInput (the surface vanished); the errors of the single steps.
[[nodiscard]] Solution solve(const Problem& problem, const Choices& choices, StartSurface start,
                             const EdgeOptions& edge, Reached* reached);

}  // namespace covol::pipeline
